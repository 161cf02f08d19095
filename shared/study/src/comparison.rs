use std::collections::BTreeSet;
use std::fmt;

use reports::lesson::LessonReport;
use serde::Serialize;

use crate::participants::{ByCondition, ChiSquare, TASKS, Task};
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
        Self { cells, chi_square: TASKS.iter().filter_map(Task::chi_square).collect() }
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
            let ByCondition { social, nonsocial } = task.counts;
            for (condition, row, test) in [("social", social, Some(test)), ("nonsocial", nonsocial, None)] {
                let name = format!("Task {} {condition}", task.number);
                let other = row.other.map_or_else(|| "-".to_owned(), |count| count.to_string());
                let (taking, not) = (row.perspective_taking, row.not_perspective_taking);
                write!(out, "  {name:<20} {taking:>4} {not:>4} {other:>6}")?;
                if let Some(ChiSquare { statistic, degrees, p }) = test {
                    write!(out, "   {statistic:.2}, df {degrees}, p = {p:.1e}")?;
                }
                writeln!(out)?;
            }
        }
        writeln!(out, "\nTable 2: the hypotheses of high likelihood, the winner in capitals")?;
        for cell in &self.cells {
            let mark = if cell.holds() { "=" } else { "DIFFERS" };
            let paper = ranked(cell.expected.hypotheses.iter().map(|rule| rule.paper));
            writeln!(out, "  {:<18} paper: {paper:<38} {mark}", cell.name())?;
            let winner = cell.winner.as_deref().unwrap_or("nothing");
            let others = cell.hypotheses.iter().map(String::as_str).filter(|name| *name != winner);
            writeln!(out, "  {:<18} Leo:   {}", "", ranked(std::iter::once(winner).chain(others)))?;
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
            let ByCondition { social, nonsocial } = task.chosen;
            for (condition, chosen, with_teacher) in
                [("social", social, true), ("nonsocial", nonsocial, false)]
            {
                let name = format!("Task {} {condition}", task.number);
                let agrees = self.agrees(task.number, with_teacher, chosen.first());
                writeln!(out, "  {name:<18} {:<58} {agrees}", ranked(chosen.iter().copied()))?;
            }
        }
        let held = self.cells.iter().filter(|cell| cell.holds()).count();
        writeln!(out, "\n{held} of {} cells of Table 2 are as in the paper", self.cells.len())
    }
}

impl Comparison {
    /// "=" if Leo's winner is the rule most popular with people, otherwise "differs". The social condition is compared
    /// with perspective taking, the nonsocial one without.
    fn agrees(&self, task: u32, social: bool, popular: Option<&&str>) -> &'static str {
        let is_cell = |cell: &&Cell| cell.expected.task == task && cell.expected.perspective_taking == social;
        let Some(cell) = self.cells.iter().find(is_cell) else { return "" };
        let winner = cell.expected.hypotheses.iter().find(|rule| cell.winner.as_deref() == Some(rule.leo));
        if winner.is_some_and(|rule| popular == Some(&rule.paper)) { "=" } else { "differs" }
    }
}

/// The names of rules, the first one in capitals.
fn ranked<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let in_capitals =
        |(rank, name): (usize, &str)| if rank == 0 { name.to_uppercase() } else { name.to_owned() };
    names.enumerate().map(in_capitals).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use reports::lesson::{self, Hypothesis, Performance, Rule};

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
        let mut task = lesson::Task::default();
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
    fn the_results_of_the_paper_agree_with_the_paper() {
        let comparison = Comparison::of(CELLS.iter().map(|cell| Cell::of(*cell, &report(cell))).collect());
        assert!(comparison.holds(), "{comparison}");
        let text = comparison.to_string();
        assert!(text.contains("8 of 8 cells") && !text.contains("iffers"), "{text}");
    }

    #[test]
    fn every_difference_from_the_paper_is_reported() {
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
