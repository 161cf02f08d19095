/// What the dialogue knows when a sentence is said. Words of it are preferred where a sentence has a typing error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Context {
    /// The names of the known tasks.
    pub tasks: Vec<String>,
    /// The task that "it" refers to: the one last taught or performed.
    pub current: Option<String>,
    /// The task that is being shown.
    pub showing: Option<String>,
    /// Whether the robot moves: then more sentences mean "stop".
    pub is_moving: bool,
    /// The words for features of objects, such as "blue" or "square".
    pub features: Vec<String>,
    /// The names of the features, such as "colour".
    pub feature_names: Vec<String>,
}

impl Context {
    /// All names that a sentence may refer to.
    pub(crate) fn names(&self) -> impl Iterator<Item = &String> {
        self.tasks.iter().chain(&self.showing)
    }

    /// The task that a pronoun refers to.
    pub(crate) fn referent(&self) -> Option<&String> {
        self.showing.as_ref().or(self.current.as_ref())
    }
}
