//! The fixed-rate cycle: release times on an absolute grid, overruns, histograms.
