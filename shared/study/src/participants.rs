//! Results of the 41 participants: Tables 1 and 3.

use quantity::number::float;
use serde::Serialize;

/// One value for each condition of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ByCondition<T> {
    /// The participants sat opposite a teacher.
    pub social: T,
    /// The participants saw pictures.
    pub nonsocial: T,
}

/// A row of Table 1: the number of participants for each rule in one task and condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParticipantCounts {
    /// Participants with the perspective-taking rule.
    pub perspective_taking: u32,
    /// Participants with the rule without perspective taking.
    pub not_perspective_taking: u32,
    /// Participants with another rule; `None` if the paper has no such column.
    pub other: Option<u32>,
}

/// The participants' results for one task of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// The task, 1 to 4.
    pub number: u32,
    /// Its rows of Table 1.
    pub counts: ByCondition<ParticipantCounts>,
    /// Its rows of Table 3: the chosen rules, the most popular one first.
    pub chosen: ByCondition<&'static [&'static str]>,
}

const fn counts(
    perspective_taking: u32,
    not_perspective_taking: u32,
    other: Option<u32>,
) -> ParticipantCounts {
    ParticipantCounts { perspective_taking, not_perspective_taking, other }
}

const FIGURES: ByCondition<&[&str]> =
    ByCondition { social: &["rotate figure", "mirror figure"], nonsocial: &["mirror figure"] };

/// Tables 1 and 3.
pub const TASKS: [Task; 4] = [
    Task {
        number: 1,
        counts: ByCondition { social: counts(6, 1, Some(13)), nonsocial: counts(1, 12, Some(8)) },
        chosen: ByCondition {
            social: &["all", "number", "spatial arrangement"],
            nonsocial: &["all but blue", "spatial arrangement", "all but one"],
        },
    },
    Task {
        number: 2,
        counts: ByCondition { social: counts(16, 0, Some(4)), nonsocial: counts(7, 12, Some(2)) },
        chosen: ByCondition {
            social: &["all red and green", "shape preference", "spatial arrangement"],
            nonsocial: &["shape preference", "all red and green"],
        },
    },
    Task {
        number: 3,
        counts: ByCondition { social: counts(12, 8, None), nonsocial: counts(0, 21, None) },
        chosen: FIGURES,
    },
    Task {
        number: 4,
        counts: ByCondition { social: counts(14, 6, None), nonsocial: counts(0, 21, None) },
        chosen: FIGURES,
    },
];

/// Pearson's chi-square test of independence between the condition and the rule.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChiSquare {
    /// Σ (observed − expected)² / expected.
    pub statistic: f64,
    /// Degrees of freedom.
    pub degrees: u32,
    /// The p-value: the probability of a statistic at least as large under independence.
    pub p: f64,
}

impl Task {
    /// The test on the rows of the task; empty columns are left out. `None` unless two or three columns remain.
    #[must_use]
    pub fn chi_square(&self) -> Option<ChiSquare> {
        let [social, nonsocial] = [self.counts.social, self.counts.nonsocial].map(|row| {
            [row.perspective_taking, row.not_perspective_taking, row.other.unwrap_or(0)]
                .map(|count| float(u64::from(count)))
        });
        let columns: Vec<[f64; 2]> =
            social.into_iter().zip(nonsocial).map(|(a, b)| [a, b]).filter(|[a, b]| a + b > 0.0).collect();
        let rows = [0, 1].map(|row| columns.iter().filter_map(|column| column.get(row)).sum::<f64>());
        let all: f64 = rows.iter().sum();
        let cells = columns.iter().flat_map(|column| {
            let of_column: f64 = column.iter().sum();
            column.iter().zip(rows).map(move |(observed, of_row)| (*observed, of_row * of_column / all))
        });
        let statistic: f64 = cells.map(|(observed, expected)| (observed - expected).powi(2) / expected).sum();
        // The survival function of the chi-square distribution, which has a closed form for each of these.
        let (degrees, p) = match columns.len() {
            2 => (1, libm::erfc((statistic / 2.0).sqrt())),
            3 => (2, (-statistic / 2.0).exp()),
            _ => return None,
        };
        Some(ChiSquare { statistic, degrees, p })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_participants_are_counted() {
        for task in TASKS {
            let rows = [task.counts.social, task.counts.nonsocial];
            let all =
                rows.map(|row| row.perspective_taking + row.not_perspective_taking + row.other.unwrap_or(0));
            assert_eq!(all, [20, 21]);
        }
    }

    #[test]
    fn every_difference_is_highly_significant() {
        let expected = [(14.05, 2, 8.9e-4), (16.17, 2, 3.1e-4), (17.81, 1, 2.4e-5), (22.32, 1, 2.3e-6)];
        for (task, (statistic, degrees, p)) in TASKS.iter().zip(expected) {
            let test = task.chi_square().unwrap();
            assert!((test.statistic - statistic).abs() < 0.006, "{test:?}");
            assert!((test.p / p - 1.0).abs() < 0.05 && test.p < 0.001, "{test:?}");
            assert_eq!(test.degrees, degrees);
        }
    }
}
