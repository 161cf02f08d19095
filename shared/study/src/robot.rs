//! Results of the paper's robot: Table 2, with the names that Leo generates for the same rules.
//!
//! The names depend on the blocks of Leo's lessons. Leo generates them from learned rules; they are not stored anywhere
//! else.

use serde::Serialize;

/// A rule of Table 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Rule {
    /// Its name in the paper.
    pub paper: &'static str,
    /// Its name in Leo's words.
    pub leo: &'static str,
}

/// A cell of Table 2, and the expected performance on the novel set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Expected {
    /// The task, 1 to 4.
    pub task: u32,
    /// Whether the robot takes perspectives.
    pub perspective_taking: bool,
    /// The high-likelihood hypotheses, the winner first.
    pub hypotheses: &'static [Rule],
    /// The steps on the novel set of the lesson when the winner is performed.
    pub performed: &'static [&'static str],
}

const ALL: Rule = Rule { paper: "all", leo: "all" };
const ALL_BUT_BLUE: Rule = Rule { paper: "all but blue", leo: "all but blue" };
const RED_AND_GREEN: Rule = Rule { paper: "all red and green", leo: "all red and green" };
const SHAPES: Rule = Rule { paper: "shape preference", leo: "all triangle, long and bridge" };
const ROTATE: Rule =
    Rule { paper: "rotate figure", leo: "6 things turned by 180°, as they stood before you" };
const MIRROR: Rule = Rule { paper: "mirror figure", leo: "6 things as they stood before me" };

const ROW: &[&str] = &[
    "blue slab in place",
    "green square in place",
    "red square in place",
    "red square in place",
    "red square in place",
    "yellow triangle in place",
];
const LETTERS: &[&str] = &[
    "blue long in place",
    "blue long in place",
    "red long in place",
    "red long in place",
    "small green cylinder in place",
    "small green square in place",
];

/// Table 2. The steps are in alphabetical order.
pub const CELLS: [Expected; 8] = [
    Expected {
        task: 1,
        perspective_taking: true,
        hypotheses: &[ALL, ALL_BUT_BLUE],
        performed: &[
            "blue square filled",
            "blue square filled",
            "green square filled",
            "red square filled",
            "yellow square filled",
        ],
    },
    Expected {
        task: 1,
        perspective_taking: false,
        hypotheses: &[ALL_BUT_BLUE],
        performed: &["green square filled", "red square filled", "yellow square filled"],
    },
    Expected {
        task: 2,
        perspective_taking: true,
        hypotheses: &[RED_AND_GREEN, SHAPES],
        performed: &["green cylinder marked", "green triangle marked", "red square marked"],
    },
    Expected {
        task: 2,
        perspective_taking: false,
        hypotheses: &[SHAPES],
        performed: &["blue triangle marked", "green triangle marked"],
    },
    Expected { task: 3, perspective_taking: true, hypotheses: &[ROTATE, MIRROR], performed: ROW },
    Expected { task: 3, perspective_taking: false, hypotheses: &[MIRROR], performed: ROW },
    Expected { task: 4, perspective_taking: true, hypotheses: &[ROTATE, MIRROR], performed: LETTERS },
    Expected { task: 4, perspective_taking: false, hypotheses: &[MIRROR], performed: LETTERS },
];
