use belief::percepts::{Kernel, Percepts, Space};
use config::Names;
use message::{Belief, Difference, Feature};

/// The names of the percepts and symbols, and the phrases about them.
#[derive(Clone, Debug)]
pub struct PerceptPhrases {
    percepts: Vec<Word>,
    names: Names,
    /// The percept that gives a thing's position.
    pub position: Option<u16>,
    /// The percepts that classify a thing, in word order: the noun is last.
    class: Vec<u16>,
    /// Those of the class whose word is a noun.
    nouns: Vec<u16>,
    /// The percepts that give a thing's states.
    states: Vec<u16>,
}

#[derive(Clone, Debug)]
struct Word {
    name: String,
    symbols: Vec<String>,
}

impl PerceptPhrases {
    /// The names of a robot's percepts.
    #[must_use]
    pub fn of(percepts: &Percepts) -> Self {
        let class = percepts.nearest_in(Space::Colour).chain(percepts.nearest_in(Space::Shape));
        let states = percepts.with_kernel(|kernel| matches!(kernel, Kernel::State(_)));
        let words = percepts.percepts.iter().map(|percept| Word {
            name: percept.name.clone(),
            symbols: percept.symbols().map(str::to_owned).collect(),
        });
        Self {
            percepts: words.collect(),
            names: Names::default(),
            position: percepts.place(),
            class: class.collect(),
            nouns: percepts.nearest_in(Space::Shape).collect(),
            states: states.collect(),
        }
    }

    /// The same, with the agents' names.
    #[must_use]
    pub fn with_names(self, names: &Names) -> Self {
        Self { names: names.clone(), ..self }
    }

    /// The agents' names.
    #[must_use]
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// The name of a percept.
    #[must_use]
    pub fn name(&self, percept: u16) -> &str {
        self.percepts.get(usize::from(percept)).map_or("?", |word| &word.name)
    }

    /// The name of a symbol of a percept.
    #[must_use]
    pub fn symbol(&self, percept: u16, symbol: u16) -> Option<&str> {
        let word = self.percepts.get(usize::from(percept))?;
        word.symbols.get(usize::from(symbol)).map(String::as_str)
    }

    /// The class of a thing: "red square", "red thing" if its shape is unknown, or "thing" if nothing of it is known.
    #[must_use]
    pub fn thing(&self, belief: &Belief) -> String {
        let word = |percept: &u16| self.symbol(*percept, belief.symbol(*percept)?);
        let words = self.class.iter().filter_map(word);
        let has_noun = self.nouns.iter().any(|percept| word(percept).is_some());
        words.chain((!has_noun).then_some("thing")).collect::<Vec<_>>().join(" ")
    }

    /// The state of a thing by a percept: "filled", "not filled"; `None` if it has none.
    #[must_use]
    pub fn state(&self, percept: u16, belief: &Belief) -> Option<String> {
        Some(degree(self.name(percept), belief.number(percept)?))
    }

    /// The percepts that give a thing's states.
    #[must_use]
    pub fn states(&self) -> &[u16] {
        &self.states
    }

    /// The percepts that classify a thing, in word order.
    #[must_use]
    pub fn class(&self) -> &[u16] {
        &self.class
    }

    /// The sentence for a difference between the perspective named `who` and the robot's about a thing. What one side
    /// does not know is no mistake of the other.
    #[must_use]
    pub fn divergence(&self, who: &str, thing: &str, difference: &Difference) -> String {
        match (difference.one(), difference.other()) {
            (Some(_), None) => return format!("{who} does not know of the {thing}"),
            (None, _) => return format!("{who} believes in a {thing} in which Leo does not"),
            (Some(_), Some(_)) => {}
        }
        let names = |is_such: fn(bool, bool) -> bool| {
            let aspects = difference.aspects().iter();
            let such = aspects.filter(|aspect| is_such(aspect.one().is_some(), aspect.other().is_some()));
            such.map(|aspect| self.name(aspect.percept)).collect::<Vec<_>>().join(", ")
        };
        let of_both = names(|robots, theirs| robots == theirs);
        if !of_both.is_empty() {
            let is_position = self.position.is_some_and(|position| of_both == self.name(position));
            return if is_position {
                format!("{who} does not know that the {thing} moved")
            } else {
                format!("{who} is mistaken about the {thing}: {of_both}")
            };
        }
        let of_robot = names(|robots, _| robots);
        if of_robot.is_empty() {
            format!("{who} has beliefs about the {thing} that Leo lacks: {}", names(|_, theirs| theirs))
        } else {
            format!("{who} does not know everything about the {thing}: {of_robot}")
        }
    }

    /// A feature in words.
    #[must_use]
    pub fn feature(&self, percept: u16, feature: Option<Feature>) -> String {
        match feature {
            None | Some(Feature::None) => "unknown".to_owned(),
            Some(Feature::Symbol(symbol)) => {
                self.symbol(percept, symbol).map_or_else(|| symbol.to_string(), str::to_owned)
            }
            Some(Feature::Number(value)) => degree(self.name(percept), value),
            Some(Feature::Vector(vector)) => place(vector.map(f64::from)),
            Some(Feature::Orientation([x, y, z, w])) => format!("({x:.2}, {y:.2}, {z:.2}, {w:.2})"),
        }
    }
}

/// The display name of a perspective by the agents of its path: "Leo", "partner 1", or for a nested one "partner 1's
/// Leo".
#[must_use]
pub fn perspective_name(names: &Names, agents: &[u16]) -> String {
    match agents {
        [] => names.of(0),
        agents => agents.iter().map(|agent| names.of(*agent)).collect::<Vec<_>>().join("'s "),
    }
}

/// A position in words.
pub(crate) fn place([x, y, z]: [f64; 3]) -> String {
    // Avoids "-0.00".
    let [x, y, z] = [x, y, z].map(|part| if part.abs() < 0.005 { 0.0 } else { part });
    format!("({x:.2}, {y:.2}, {z:.2})")
}

fn degree(name: &str, value: f32) -> String {
    if value > 0.95 {
        name.to_owned()
    } else if value < 0.05 {
        format!("not {name}")
    } else {
        format!("{name} {value:.2}")
    }
}
