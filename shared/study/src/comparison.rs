use std::collections::BTreeSet;
use std::fmt;

use reports::lesson::LessonReport;
use serde::Serialize;

use crate::people::{ChiSquare, TASKS};
use crate::robot::Expected;

/// What Leo learned and did in one task and condition, compared with the paper.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// The result in the paper.
    pub expected: Expected,
    /// The rule that Leo chose and performed.
    pub winner: Option<String>,
    /// The high-likelihood hypotheses of all perspectives together.
    pub hypotheses: BTreeSet<String>,
    /// The steps done on the novel set, in alphabetical order.
    pub performed: Vec<String>,
    /// Perspectives in which anything was learned.
    pub perspectives: Vec<String>,
    /// The differences from the paper; empty if there are none.
    pub differs: Vec<String>,
}

impl Cell {
    /// Evaluates the report of a task's lesson.
    #[must_use]
    pub fn of(expected: Expected, report: &LessonReport) -> Self {
        let task = report.tasks.first();
        let by_perspective = task.iter().flat_map(|task| &task.hypotheses);
        let hypotheses = by_perspective.clone().flat_map(|(_, hypotheses)| hypotheses);
        let performances = task.map_or(&[][..], |task| &task.performances);
        let mut performed: Vec<String> = performances.iter().flat_map(|done| done.done.clone()).collect();
        performed.sort();
        let mut cell = Self {
            expected,
            winner: task.and_then(|task| task.rule.as_ref()).map(|rule| rule.name.clone()),
            hypotheses: hypotheses.filter(|one| one.high_likelihood).map(|one| one.name.clone()).collect(),
            performed,
            perspectives: by_perspective.map(|(perspective, _)| perspective.clone()).collect(),
            differs: Vec::new(),
        };
        let failed = performances.iter().flat_map(|performance| &performance.failed);
        cell.differs = cell.differences();
        cell.differs.extend(failed.map(|failure| format!("failed: {failure}")));
        cell
    }

    /// Whether it agrees with the paper.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.differs.is_empty()
    }

    fn differences(&self) -> Vec<String> {
        let Expected { hypotheses, performed, perspective_taking, .. } = self.expected;
        let mut differs = Vec::new();
        let winner = hypotheses.first().map(|rule| rule.leo);
        if self.winner.as_deref() != winner {
            let chosen = self.winner.as_deref().unwrap_or("nothing");
            differs.push(format!("chose \"{chosen}\", not \"{}\"", winner.unwrap_or("nothing")));
        }
        let wanted: BTreeSet<&str> = hypotheses.iter().map(|rule| rule.leo).collect();
        let found: BTreeSet<&str> = self.hypotheses.iter().map(String::as_str).collect();
        differs.extend(wanted.difference(&found).map(|name| format!("did not think of \"{name}\"")));
        differs.extend(found.difference(&wanted).map(|name| format!("thought of \"{name}\"")));
        if self.performed != performed {
            differs.push(format!("did {:?}, not {performed:?}", self.performed));
        }
        let partners = self.perspectives.iter().any(|perspective| perspective != "robot");
        if partners != perspective_taking {
            differs.push(format!("learned in the perspectives of {:?}", self.perspectives));
        }
        differs
    }

    fn name(&self) -> String {
        let with = if self.expected.perspective_taking { "with PT" } else { "without PT" };
        format!("Task {} {with}", self.expected.task)
    }
}

/// The whole study, compared with the paper.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Comparison {
    /// Table 2, cell by cell.
    pub cells: Vec<Cell>,
    /// The tests of Table 1, task by task.
    pub chi_square: Vec<ChiSquare>,
}

impl Comparison {
    /// The comparison for these cells.
    #[must_use]
    pub fn of(cells: Vec<Cell>) -> Self {
        Self { cells, chi_square: TASKS.iter().filter_map(crate::people::Task::chi_square).collect() }
    }

    /// Whether every cell agrees with the paper.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.cells.iter().all(Cell::holds)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "Table 1: the rules of 41 participants, and whether the condition made a difference")?;
        writeln!(out, "  {:<20} {:>4} {:>4} {:>6}   chi-square", "", "PT", "NPT", "other")?;
        for (task, test) in TASKS.iter().zip(&self.chi_square) {
            for row in task.rules {
                let condition = if row.social { "social" } else { "nonsocial" };
                let name = format!("Task {} {condition}", task.number);
                let other = row.other.map_or_else(|| "-".to_owned(), |count| count.to_string());
                let (taking, not) = (row.perspective_taking, row.not_perspective_taking);
                write!(out, "  {name:<20} {taking:>4} {not:>4} {other:>6}")?;
                if row.social {
                    let ChiSquare { statistic, degrees, p } = test;
                    write!(out, "   {statistic:.2}, df {degrees}, p = {p:.1e}")?;
                }
                writeln!(out)?;
            }
        }
        writeln!(out, "\nTable 2: the hypotheses of high likelihood, the winner in capitals")?;
        for cell in &self.cells {
            let mark = if cell.holds() { "=" } else { "DIFFERS" };
            let rules = cell.expected.hypotheses.iter().enumerate();
            let paper: Vec<String> = rules
                .map(|(rank, rule)| if rank == 0 { rule.paper.to_uppercase() } else { rule.paper.to_owned() })
                .collect();
            writeln!(out, "  {:<18} paper: {:<38} {mark}", cell.name(), paper.join("; "))?;
            let winner = cell.winner.clone().unwrap_or_else(|| "nothing".to_owned());
            let others = cell.hypotheses.iter().filter(|name| **name != winner).cloned();
            let leo: Vec<String> = std::iter::once(winner.to_uppercase()).chain(others).collect();
            writeln!(out, "  {:<18} Leo:   {}", "", leo.join("; "))?;
            writeln!(out, "  {:<18} did:   {}", "", cell.performed.join(", "))?;
            for difference in &cell.differs {
                writeln!(out, "  {:<18} but:   {difference}", "")?;
            }
        }
        writeln!(
            out,
            "\nTable 3: what people chose, the most popular in capitals; = where Leo's winner is that"
        )?;
        for task in TASKS {
            for (social, chosen) in [true, false].into_iter().zip(task.chosen) {
                let condition = if social { "social" } else { "nonsocial" };
                let name = format!("Task {} {condition}", task.number);
                writeln!(out, "  {name:<18} {:<58} {}", chosen.join("; "), self.agrees(task.number, social))?;
            }
        }
        let held = self.cells.iter().filter(|cell| cell.holds()).count();
        writeln!(out, "\n{held} of {} cells of Table 2 are as in the paper", self.cells.len())
    }
}

impl Comparison {
    /// "=" if Leo's winner is the rule most popular with people, otherwise "differs". The social condition is compared
    /// with perspective taking, the nonsocial one without.
    fn agrees(&self, task: u32, social: bool) -> &'static str {
        let people = TASKS.iter().find(|people| people.number == task);
        let [of_social, of_nonsocial] = people.map_or([&[][..]; 2], |people| people.chosen);
        let popular = if social { of_social } else { of_nonsocial }.first();
        let is_cell = |cell: &&Cell| cell.expected.task == task && cell.expected.perspective_taking == social;
        let Some(cell) = self.cells.iter().find(is_cell) else { return "" };
        let winner = cell.expected.hypotheses.iter().find(|rule| cell.winner.as_deref() == Some(rule.leo));
        let same =
            winner.is_some_and(|rule| popular.is_some_and(|name| name.eq_ignore_ascii_case(rule.paper)));
        if same { "=" } else { "differs" }
    }
}

#[cfg(test)]
mod tests {
    use reports::lesson::{Hypothesis, LessonReport, Performance, Rule, Task};

    use super::*;
    use crate::robot::CELLS;

    fn report(expected: &Expected) -> LessonReport {
        let hypothesis = |name: &str| Hypothesis {
            name: name.to_owned(),
            rank: 1,
            tally: 2,
            posterior: 1.0,
            high_likelihood: true,
        };
        let mut task = Task::default();
        let mut rules = expected.hypotheses.iter();
        let winner = rules.next().unwrap();
        let (first, others) =
            if expected.perspective_taking { ("human", "robot") } else { ("robot", "robot") };
        task.rule = Some(Rule { perspective: first.to_owned(), name: winner.leo.to_owned() });
        task.hypotheses.entry(first.to_owned()).or_default().push(hypothesis(winner.leo));
        for rule in rules {
            task.hypotheses.entry(others.to_owned()).or_default().push(hypothesis(rule.leo));
        }
        let done = expected.performed.iter().rev().map(|step| (*step).to_owned()).collect();
        task.performances.push(Performance { done, ..Performance::default() });
        let mut report = LessonReport::default();
        report.tasks.push(task);
        report
    }

    #[test]
    fn the_papers_own_outcome_is_as_in_the_paper() {
        let comparison = Comparison::of(CELLS.iter().map(|cell| Cell::of(*cell, &report(cell))).collect());
        assert!(comparison.holds(), "{comparison}");
        let text = comparison.to_string();
        assert!(text.contains("8 of 8 cells") && !text.contains("iffers"), "{text}");
    }

    #[test]
    fn whatever_is_otherwise_is_told() {
        let [expected, ..] = CELLS;
        assert_eq!(Cell::of(expected, &LessonReport::default()).differs.len(), 5);
        let mut other = report(&expected);
        other.tasks[0].performances[0].done.pop();
        assert_eq!(Cell::of(expected, &other).differs.len(), 1);
        let mut other = report(&expected);
        other.tasks[0].rule.as_mut().unwrap().name = "all red".to_owned();
        let text = Comparison::of(vec![Cell::of(expected, &other)]).to_string();
        assert!(text.contains("\"all red\"") && text.contains("0 of 1"), "{text}");
        insta::assert_snapshot!(text);
    }
}
