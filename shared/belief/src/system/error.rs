/// Reasons why a belief system cannot be created.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BeliefSystemError {
    /// The capacity is out of range.
    #[error("a belief system for {capacity} beliefs: the capacity must be from 1 to 1000000")]
    Capacity {
        /// Requested number of beliefs.
        capacity: usize,
    },
    /// The configuration names a plug-in function that the program does not supply.
    #[error("the configuration names the custom {what} `{name}`, which this program does not have")]
    NoSuchFunction {
        /// The kind of function.
        what: &'static str,
        /// Its name.
        name: String,
    },
    /// A plug-in history keeps too many samples, or none.
    #[error("the custom history `{name}` keeps {samples} samples: it must be from 1 to 4096")]
    Samples {
        /// Its name.
        name: String,
        /// The number of samples that it requests.
        samples: usize,
    },
}
