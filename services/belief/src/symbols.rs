use belief::percepts::{Kernel, Percept, Percepts, Role, Space};
use invariant::invariant;
use message::{MAX_SOURCES, MAX_SYMBOLS, PerceptDescription, PerceptKernel, PerceptRole, Symbols};

const _: () = assert!(MAX_SOURCES <= MAX_SYMBOLS, "every source of a robot has a name");

/// The names of what the beliefs of a robot refer to by number. `sources` and `agents` are the names of the sensory
/// sources and of the agents, by number; agent 0 is the robot.
///
/// ```
/// let percepts = belief::percepts::Percepts::builtin();
/// let symbols = belief_process::symbols(&percepts, &["simulator"], ["Leo", "the teacher"]);
/// let colour = percepts.index("colour").unwrap();
/// assert_eq!(symbols.symbol(colour, 3), Some("yellow"));
/// assert_eq!(symbols.agents()[1].as_str(), "the teacher");
/// ```
#[must_use]
pub fn symbols(
    percepts: &Percepts,
    sources: &[&str],
    agents: impl IntoIterator<Item = impl AsRef<str>>,
) -> Symbols {
    let mut symbols = Symbols::default();
    for percept in &percepts.percepts {
        let fits = symbols.push_percept(describe(percept, sources));
        invariant!(fits, "the configuration limits the number of percepts: `{}`", percept.name);
    }
    for agent in agents {
        let fits = symbols.push_agent(agent.as_ref());
        invariant!(fits, "each agent has a perspective, and their number is limited");
    }
    symbols
}

fn describe(percept: &Percept, sources: &[&str]) -> PerceptDescription {
    let (role, kernel) = (role(percept.role), kernel(&percept.kernel));
    let mut description = PerceptDescription::new(&percept.name, role, kernel, percept.parent);
    // The symbol of this kernel is the number of a source.
    let sources = if kernel == PerceptKernel::Source { sources } else { &[] };
    for name in percept.symbols().chain(sources.iter().copied()) {
        let fits = description.push_symbol(name);
        invariant!(fits, "the configuration limits the number of symbols: `{name}`");
    }
    description
}

fn role(role: Role) -> PerceptRole {
    match role {
        Role::Criteria => PerceptRole::Criteria,
        Role::Expectation => PerceptRole::Expectation,
        Role::Neither => PerceptRole::Neither,
    }
}

fn kernel(kernel: &Kernel) -> PerceptKernel {
    match kernel {
        Kernel::Position => PerceptKernel::Position,
        Kernel::Orientation => PerceptKernel::Orientation,
        Kernel::Extents => PerceptKernel::Extents,
        Kernel::Source => PerceptKernel::Source,
        Kernel::State(_) => PerceptKernel::State,
        Kernel::Nearest(nearest) => match nearest.space {
            Space::Shape => PerceptKernel::NearestShape,
            Space::Colour => PerceptKernel::NearestColour,
            Space::EdgeM => PerceptKernel::NearestSize,
        },
        Kernel::Region(_) => PerceptKernel::Region,
        Kernel::Range(_) => PerceptKernel::Range,
        Kernel::Plugin(_) => PerceptKernel::Plugin,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use message::{FeatureUnit, Name};
    use perception::{Frame, Perception};

    use super::*;

    fn names(names: &[Name]) -> Vec<&str> {
        names.iter().map(Name::as_str).collect()
    }

    #[test]
    fn every_percept_and_every_symbol_of_the_configuration_is_named() {
        let percepts = Percepts::builtin();
        let symbols = symbols(&percepts, &["simulator"], ["Leo", "Anna"]);
        assert_eq!(symbols.percepts().len(), percepts.percepts.len());
        let mut named = 0;
        for (description, percept) in symbols.percepts().iter().zip(&percepts.percepts) {
            assert_eq!(description.name.as_str(), percept.name);
            assert_eq!(description.role(), Some(role(percept.role)), "{}", percept.name);
            assert_eq!(description.parent(), percept.parent, "{}", percept.name);
            assert_eq!(names(description.symbols()), percept.symbols().collect::<Vec<_>>());
            named += description.symbols().len();
        }
        assert_eq!((named, names(symbols.agents())), (18, vec!["Leo", "Anna"]));
    }

    #[test]
    fn the_described_feature_is_the_one_that_the_classifier_derives() {
        let percepts = Percepts::builtin();
        let symbols = symbols(&percepts, &[], ["Leo"]);
        let perception = Perception::new(&percepts).unwrap();
        let mut seen = message::Observation::object(0, 1);
        seen.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        seen.half_extents_m = [0.03; 3];
        seen.colour_rgb = [0.80, 0.05, 0.05];
        seen.shape = [0.0; 4];
        seen.states = [1.0; message::STATES];
        let snapshot = perception.perceive(&seen, &Frame { agent: 0 });
        let mut compared = 0;
        for value in snapshot.values() {
            let described = &symbols.percepts()[usize::from(value.percept)];
            let (kind, _) = value.raw_feature();
            assert_eq!(described.feature_kind().map(message::FeatureKind::raw), Some(kind), "{described:?}");
            compared += 1;
        }
        assert!(compared > 8, "only {compared} percepts match");
    }

    #[test]
    fn the_symbols_of_a_source_percept_are_the_sources() {
        let text = "threshold = 0.5\n[[percept]]\nname = \"seen_by\"\nrole = \"neither\"\ndecay_per_s = 0.0\n\
                    history = { lossless = { samples = 4, when_full = \"thin\" } }\nkernel = \"source\"\n\
                    [belief]\nthreshold = 0.3\nnormalised = false\ncannot_link_same_source_instant = true\n\
                    no_term_applies = \"infinite\"\n";
        let percepts = Percepts::parse(text, Path::new("p.toml")).unwrap();
        let symbols = symbols(&percepts, &["simulator", "camera"], ["Leo"]);
        let [percept] = symbols.percepts() else { panic!("{symbols:?}") };
        assert_eq!(names(percept.symbols()), ["simulator", "camera"]);
        assert_eq!(percept.unit(), Some(FeatureUnit::None));
    }
}
