//! Simulator process: the workspace, the teacher and Leo's body.
