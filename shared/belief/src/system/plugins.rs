//! Plug-in functions that a program supplies to a belief system.

use std::fmt;
use std::sync::Arc;

use super::cull::Cull;
use super::error::BeliefSystemError;
use crate::association::Distance;
use crate::storage::{History, MAX_PLUGIN_SAMPLES};

/// The plug-in functions of a program, under the names that the configuration uses.
///
/// ```
/// use std::sync::Arc;
///
/// use belief::{BeliefSystem, Distance, BeliefPlugins};
/// use belief::percepts::{Measure, Percepts};
/// use message::Feature;
///
/// /// Distance of colours that may fade: red and wood are near each other.
/// struct Fading;
///
/// impl Distance for Fading {
///     fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
///         match (one, other) {
///             (Feature::Symbol(one), Feature::Symbol(other)) if one == other => Some(0.0),
///             (Feature::Symbol(0 | 4), Feature::Symbol(0 | 4)) => Some(0.1),
///             (Feature::Symbol(_), Feature::Symbol(_)) => Some(1.0),
///             _ => None,
///         }
///     }
/// }
///
/// // Like `measure = { plugin = "fading" }` for the colour in `percepts.toml`.
/// let mut percepts = Percepts::builtin();
/// let colour = percepts.index("colour").unwrap();
/// for term in percepts.belief.distance.iter_mut().filter(|term| term.percept == colour) {
///     term.measure = Measure::Plugin("fading".to_owned());
/// }
/// assert!(BeliefSystem::new(&percepts, 16).unwrap_err().to_string().contains("`fading`"));
///
/// let mut functions = BeliefPlugins::default();
/// functions.distances.push(("fading".to_owned(), Arc::new(Fading)));
/// assert!(BeliefSystem::with_plugins(&percepts, &functions, 16).is_ok());
/// ```
#[derive(Clone, Default)]
pub struct BeliefPlugins {
    /// d and q.
    pub distances: Vec<(String, Arc<dyn Distance>)>,
    /// c.
    pub culls: Vec<(String, Arc<dyn Cull>)>,
    /// g.
    pub histories: Vec<(String, Arc<dyn History>)>,
}

impl fmt::Debug for BeliefPlugins {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { distances, culls, histories } = self;
        let counts = (distances.len(), culls.len(), histories.len());
        write!(out, "Functions({counts:?} distances, culls, histories)")
    }
}

impl BeliefPlugins {
    pub(crate) fn distance(&self, name: &str) -> Result<Arc<dyn Distance>, BeliefSystemError> {
        find(&self.distances, name, "distance")
    }

    pub(crate) fn cull(&self, name: &str) -> Result<Arc<dyn Cull>, BeliefSystemError> {
        find(&self.culls, name, "culling function")
    }

    pub(crate) fn history(&self, name: &str) -> Result<Arc<dyn History>, BeliefSystemError> {
        let history = find(&self.histories, name, "history")?;
        let samples = history.samples();
        if !(1..=MAX_PLUGIN_SAMPLES).contains(&samples) {
            return Err(BeliefSystemError::Samples { name: name.to_owned(), samples });
        }
        Ok(history)
    }
}

fn find<T: ?Sized>(
    functions: &[(String, Arc<T>)],
    name: &str,
    what: &'static str,
) -> Result<Arc<T>, BeliefSystemError> {
    let found = functions.iter().find(|(known, _)| known == name);
    let (_, function) =
        found.ok_or_else(|| BeliefSystemError::NoSuchFunction { what, name: name.to_owned() })?;
    Ok(Arc::clone(function))
}
