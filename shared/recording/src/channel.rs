use std::fmt;
use std::fmt::Write as _;

use message::{Recording, TopicId};

/// Prefix of the names of raw channels; the name of the topic follows.
const PREFIX: &str = "leo/";

/// The recorded topics of a robot with `perspectives` perspectives, in the order of the data flow.
pub fn recorded_topics(perspectives: u32) -> impl Iterator<Item = TopicId> {
    TopicId::of_robot(perspectives).filter(|topic| is_recorded(*topic))
}

/// Whether recordings hold a topic.
pub(crate) fn is_recorded(topic: TopicId) -> bool {
    topic.row().recording != Recording::None
}

/// The raw channel of a topic in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Channel(pub TopicId);

impl Channel {
    /// The channel of a name, such as `leo/beliefs/0`; `None` for other names.
    ///
    /// ```
    /// use message::TopicId;
    /// use recording::Channel;
    ///
    /// assert_eq!(Channel::of_name("leo/beliefs/1"), Some(Channel(TopicId::Beliefs(1))));
    /// assert_eq!(Channel(TopicId::Beliefs(1)).to_string(), "leo/beliefs/1");
    /// assert_eq!(Channel::of_name("/joint_states"), None);
    /// ```
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let name = name.strip_prefix(PREFIX)?;
        let (name, number) = match name.split_once('/') {
            Some((name, number)) => (name, Some(number.parse().ok()?)),
            None => (name, None),
        };
        TopicId::of_name(name, number).filter(|topic| is_recorded(*topic)).map(Self)
    }

    /// The name of its schema: the names of head and entry, each with its version.
    #[must_use]
    pub fn schema_name(self) -> String {
        let [head, entry] = self.0.frame_kinds();
        format!("{head}+{entry}")
    }

    /// The text of its schema: the self-contained description of a frame's bytes.
    #[must_use]
    pub fn schema(self) -> String {
        let [head, entry] = self.0.frame_kinds();
        let mut text = String::from(
            "# A frame: the head, then entries up to the end of the message. Numbers are little-endian; a line\n\
             # of a type gives the place of a field from the beginning of the type in bytes, name and kind.\n\
             # Bytes that no field names are zero.\n",
        );
        // Writing to a string cannot fail.
        let _ = writeln!(text, "head: {head}\nentry: {entry}");
        let mut said = Vec::new();
        for layout in head.layouts().into_iter().chain(entry.layouts()) {
            if !said.contains(&layout.name) {
                said.push(layout.name);
                let _ = write!(text, "\n{layout}");
            }
        }
        text
    }
}

/// Its name.
impl fmt::Display for Channel {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{PREFIX}{}", self.0)
    }
}
