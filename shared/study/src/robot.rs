//! What the paper's robot learned: Table 2, in the words that Leo computes for the same rules.
//!
//! The words are what the rules come to on the blocks of Leo's own lessons; Leo itself knows none of
//! them before it has learned the rule.

use serde::Serialize;

/// A rule of Table 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Rule {
    /// What the paper calls it.
    pub paper: &'static str,
    /// What Leo calls it, having learned it.
    pub leo: &'static str,
}

/// A cell of Table 2, and what comes of it on the novel set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Expected {
    /// 1 to 4.
    pub task: u32,
    /// Whether perspectives were taken.
    pub perspective_taking: bool,
    /// The high-likelihood hypotheses, the winning one first.
    pub hypotheses: &'static [Rule],
    /// What is done on the novel set of the lesson when the winning one is performed.
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

/// Table 2. What is performed stands in alphabetical order.
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
