//! Compatibility of two machines: message layouts and configuration.

use std::fmt;

use config::Robot;
use config::leo::RemoteProcess;

/// Version of the format after the first number of a message.
pub(crate) const LANGUAGE: u64 = 2;

/// What both machines must have in common for frames to mean the same. It is part of every message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Compatibility {
    /// The version of Leo, 16 bits for each of its three numbers. It is reported, not compared.
    pub version: u64,
    /// Hash of the layouts of all messages, see [`message::layouts`].
    pub layouts: u64,
    /// Hash of the joints: names and ranges.
    pub joints: u64,
    /// Hash of the percepts: names and classifiers.
    pub percepts: u64,
    /// Number of perspectives.
    pub perspectives: u64,
    /// The processes that run on the remote machine, one bit each.
    pub remote_processes: u64,
}

/// Number of fields of an `Compatibility`.
pub(crate) const NUMBERS: usize = 6;

impl Compatibility {
    /// The values of this program, a robot's configuration and its number of perspectives.
    pub(crate) fn of(robot: &Robot, perspectives: u32) -> Self {
        let joints = robot.motor.joints.iter();
        let joints = joints.map(|joint| format!("{} {:?} {:?}", joint.name, joint.min_rad, joint.max_rad));
        let remote_processes = robot.leo.link.remote_processes.iter().map(|process| match process {
            RemoteProcess::Learner => 1,
            RemoteProcess::Console => 2,
        });
        Self {
            version: packed(env!("CARGO_PKG_VERSION")),
            layouts: message::layouts(),
            joints: hash(joints),
            percepts: hash(robot.percepts.percepts.iter().map(|percept| format!("{percept:?}"))),
            perspectives: u64::from(perspectives),
            remote_processes: remote_processes.fold(0, |bits, bit| bits | bit),
        }
    }

    pub(crate) const fn numbers(self) -> [u64; NUMBERS] {
        let Self { version, layouts, joints, percepts, perspectives, remote_processes } = self;
        [version, layouts, joints, percepts, perspectives, remote_processes]
    }

    pub(crate) const fn of_numbers(numbers: [u64; NUMBERS]) -> Self {
        let [version, layouts, joints, percepts, perspectives, remote_processes] = numbers;
        Self { version, layouts, joints, percepts, perspectives, remote_processes }
    }

    /// Whether frames mean the same to both.
    #[must_use]
    pub const fn agrees(self, other: Self) -> bool {
        self.layouts == other.layouts
            && self.joints == other.joints
            && self.percepts == other.percepts
            && self.perspectives == other.perspectives
            && self.remote_processes == other.remote_processes
    }
}

/// The peer is incompatible. The message says what differs and what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IncompatiblePeer {
    /// The peer uses another version of the link protocol.
    Language {
        /// The peer's protocol version.
        there: u64,
    },
    /// Message layouts or configuration differ.
    Meaning {
        /// The values of this machine.
        here: Compatibility,
        /// The values of the peer.
        there: Compatibility,
    },
}

impl fmt::Display for IncompatiblePeer {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "the two machines refuse each other's messages: ")?;
        let (here, there) = match self {
            Self::Language { there } => {
                return write!(
                    out,
                    "its link uses version {there} of the link protocol, and this one version {LANGUAGE}. Install the \
                     same version of Leo on both, and restart both"
                );
            }
            Self::Meaning { here, there } => (here, there),
        };
        if here.layouts != there.layouts {
            // With another version, the other values may differ for that reason alone.
            return write!(
                out,
                "it runs Leo {} with messages {:016x}, and this is Leo {} with messages {:016x}. Install the same \
                 version of Leo on both, and restart both",
                unpacked(there.version),
                there.layouts,
                unpacked(here.version),
                here.layouts
            );
        }
        let differs = [
            (here.joints != there.joints, "the joints of motor.toml or their ranges"),
            (here.percepts != there.percepts, "the percepts of percepts.toml"),
            (here.perspectives != there.perspectives, "`partners` or `depth` of [belief] in leo.toml"),
            (here.remote_processes != there.remote_processes, "`remote_processes` of [link] in leo.toml"),
        ];
        let what: Vec<&str> = differs.iter().filter(|(differs, _)| *differs).map(|(_, what)| *what).collect();
        write!(
            out,
            "their configurations differ in {}. Make that the same on both, and restart both",
            what.join(", and in ")
        )
    }
}

/// A number that differs between lists of texts.
fn hash(texts: impl Iterator<Item = String>) -> u64 {
    // Text that moves from one to the next is a change.
    message::hash(texts.flat_map(|text| text.into_bytes().into_iter().chain([0])))
}

/// Packs the three numbers of a version; any suffix is ignored.
fn packed(version: &str) -> u64 {
    let numbers = version.split(['.', '-', '+']).take(3);
    numbers.fold(0, |all, number| all << 16 | number.parse::<u16>().map_or(0, u64::from))
}

fn unpacked(version: u64) -> String {
    let [_, major, minor, patch] = [48, 32, 16, 0].map(|bits| version >> bits & 0xffff);
    format!("{major}.{minor}.{patch}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot() -> Robot {
        Robot::load(None).unwrap()
    }

    #[test]
    fn different_message_layouts_are_reported_on_both_sides_with_what_to_do() {
        let here = Compatibility::of(&robot(), 2);
        assert_eq!(here.layouts, message::layouts());
        let there = Compatibility { version: packed("3.14.15-beta"), layouts: here.layouts ^ 1, ..here };
        assert!(!here.agrees(there) && !there.agrees(here));
        let told = IncompatiblePeer::Meaning { here, there }.to_string();
        let heard = IncompatiblePeer::Meaning { here: there, there: here }.to_string();
        let this = concat!("Leo ", env!("CARGO_PKG_VERSION"));
        let [ours, theirs] = [here, there].map(|one| format!("{:016x}", one.layouts));
        for text in [&told, &heard] {
            assert!([this, "Leo 3.14.15", &ours, &theirs].iter().all(|word| text.contains(word)), "{text}");
        }
        assert!(told.find("3.14.15") < told.find(this) && heard.find(this) < heard.find("3.14.15"));
        let told = told.replace(this, "[this Leo]").replace(&ours, "[its layouts]");
        insta::assert_snapshot!(told.replace(&theirs, "[other layouts]"));
    }

    #[test]
    fn a_different_version_alone_is_compatible() {
        let here = Compatibility::of(&robot(), 2);
        assert!(here.agrees(Compatibility { version: packed("3.0.0"), ..here }));
    }

    #[test]
    fn only_the_differing_configuration_files_and_keys_are_named() {
        let (robot, mut other) = (robot(), robot());
        other.motor.joints.first_mut().unwrap().max_rad += 1e-9;
        other.percepts.percepts.first_mut().unwrap().name.push('x');
        other.leo.link.remote_processes.pop();
        let here = Compatibility::of(&robot, 2);
        let all = Compatibility::of(&other, 3);
        let words = ["motor.toml", "percepts.toml", "`partners`", "`remote_processes`"];
        let of_numbers = |differs: usize| {
            let mut numbers = here.numbers();
            let place = differs + NUMBERS - words.len();
            numbers[place] = all.numbers()[place];
            Compatibility::of_numbers(numbers)
        };
        for (differs, word) in words.iter().enumerate() {
            let there = of_numbers(differs);
            assert!(!here.agrees(there), "{word}");
            let text = IncompatiblePeer::Meaning { here, there }.to_string();
            for other in words {
                assert_eq!(text.contains(other), other == *word, "{text}");
            }
        }
        let text = IncompatiblePeer::Meaning { here, there: all }.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
        insta::assert_snapshot!(text);
    }

    #[test]
    fn texts_are_distinguished_wherever_they_are_split() {
        let split = |words: [&str; 2]| hash(words.map(str::to_owned).into_iter());
        assert_ne!(split(["ab", "c"]), split(["a", "bc"]));
    }
}
