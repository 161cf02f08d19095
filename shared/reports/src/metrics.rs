//! The robot's health in the text format of OpenMetrics 1.0
//! (<https://prometheus.io/docs/specs/om/open_metrics_spec/>), which Prometheus and others read.
//!
//! The server of the text collects the [`Readings`] from the boards.
//!
//! ```
//! use reports::metrics::{Readings, openmetrics};
//!
//! let readings = Readings { store_bytes: Some(4096), ..Readings::default() };
//! assert!(openmetrics(&readings).contains("leo_store_bytes 4096\n"));
//! ```

mod belief_metrics;
mod body;
mod link;
mod processes;
mod quantiles;
mod readings;
#[cfg(test)]
mod tests;
mod text;

pub use quantiles::Quantiles;
pub use readings::{Readings, TaskReading};
use text::{Kind, MetricsText};

/// The media type of the text.
pub const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// The readings as OpenMetrics text. Missing readings are omitted; no value is NaN.
///
/// Units are part of the names: seconds, bytes, degrees Celsius, volts, hertz. Counters restart from zero with each
/// incarnation of their process.
#[must_use]
pub fn openmetrics(readings: &Readings) -> String {
    let mut page = MetricsText::default();
    page.family("leo_build", Kind::Info, "The program that was read.");
    page.sample("_info", &[("version", env!("CARGO_PKG_VERSION"))], 1.0);
    processes::write(readings, &mut page);
    body::write(readings, &mut page);
    link::write(readings, &mut page);
    belief_metrics::write(readings, &mut page);
    page.end()
}
