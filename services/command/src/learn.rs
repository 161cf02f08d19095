//! `leo learn`: task learning alone, over recorded before-and-after examples.

mod examples;
mod json;
mod results;
mod text;
mod vocabulary;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write as _, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use config::Names;
use tasks::{
    Decision, Example, HypothesisLanguage, Learned, Learning, Noise, Object, Settings, Signature, Snapshot,
    Task, View, decide_with,
};

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::progress::Progress;
use examples::{Examples, ExamplesError};
use results::{Answer, Conclusion, ExampleResult};

/// Hypotheses whose log posterior is this much below the best are left out of the reported rules, in nats.
const NATS: f64 = 10.0;
/// Number of objects in a demonstration that Leo asks for.
const OBJECTS: usize = 3;

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo learn config/examples/squares.jsonl --language extended --noise \
                        0.05\n\ndocs/examples-format.md says how to write examples, and what is printed.")]
pub(crate) struct Learn {
    /// The examples, as JSON lines; `-` is standard input
    #[arg(value_name = "EXAMPLES")]
    examples: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// The hypothesis language: that of the paper's robot, or the extended one [default: as configured]
    #[arg(long, value_name = "LANGUAGE")]
    language: Option<Words>,
    /// Label noise: how often a teacher errs with one object, from 0 to below 0.5 [default: as configured]
    #[arg(long, value_name = "E", value_parser = noise, allow_hyphen_values = true)]
    noise: Option<Noise>,
    /// Maximum number of rules to print for each goal
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=512))]
    rules: u16,
    /// The robot's leo.toml, for the keys of its table `learner` [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Words {
    Paper,
    Extended,
}

fn noise(text: &str) -> Result<Noise, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    Noise::try_from(number).map_err(|error| error.to_string())
}

impl Learn {
    /// Learns from all examples and prints the results of each.
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let robot = self.set.robot(self.config.as_deref())?;
        let mut settings = learner_process::learning(&robot.leo.learner);
        if let Some(words) = self.language {
            settings.language = match words {
                Words::Paper => HypothesisLanguage::Paper,
                Words::Extended => HypothesisLanguage::Extended,
            };
        }
        settings.noise = self.noise.unwrap_or(settings.noise);
        let examples = read(&self.examples).map_err(CommandError::usage)?;
        match self.tell(&examples, &settings, &robot.leo.belief.names) {
            Err(error) => Err(CommandError::output(&error)),
            Ok(()) => Ok(ExitCode::SUCCESS),
        }
    }

    fn tell(&self, examples: &Examples, settings: &Settings, names: &Names) -> std::io::Result<()> {
        let mut out = BufWriter::new(stdout().lock());
        let mut by_perspective: BTreeMap<u16, Learning> = BTreeMap::new();
        let mut newest: BTreeMap<u16, Learned> = BTreeMap::new();
        if self.json {
            out.write_all(json::opening(examples, settings)?.as_bytes())?;
        }
        let progress =
            Progress::of_steps_beside_output(u64::try_from(examples.shown.len()).unwrap_or(u64::MAX));
        for (index, shown) in examples.shown.iter().enumerate() {
            let mut learned = BTreeMap::new();
            let mut answers = Vec::new();
            for view in &shown.views {
                let learning = by_perspective
                    .entry(view.perspective)
                    .or_insert_with(|| Learning::new(&examples.language, settings));
                learning.add(view);
                let now = learning.leading(usize::from(self.rules), NATS);
                answers.extend(answer(learning, &now, view, &shown.asked));
                learned.insert(view.perspective, now.clone());
                newest.insert(view.perspective, now);
            }
            let result = ExampleResult { shown, number: index + 1, learned, answers };
            let text =
                if self.json { json::example(&result)? } else { text::example(examples, names, &result) };
            out.write_all(text.as_bytes())?;
            progress.step();
        }
        drop(progress);
        let conclusion = conclude(examples, &newest, &mut by_perspective, settings);
        let text = if self.json {
            json::closing(examples, &conclusion)?
        } else {
            text::closing(examples, names, &conclusion)
        };
        out.write_all(text.as_bytes())?;
        out.flush()
    }
}

/// A perspective's answers about the objects, for each of its goals.
fn answer(learning: &mut Learning, learned: &Learned, view: &View, asked: &[Object]) -> Vec<Answer> {
    if asked.is_empty() {
        return Vec::new();
    }
    let scene = Snapshot { objects: asked.to_vec(), ..view.before };
    let goals: Vec<Signature> = learned.primary().map(|rule| rule.expectation.clone()).collect();
    let answer = |goal: Signature| Answer {
        perspective: view.perspective,
        probabilities: learning.probabilities(&goal, &scene),
        goal,
    };
    goals.into_iter().map(answer).collect()
}

fn conclude(
    examples: &Examples,
    newest: &BTreeMap<u16, Learned>,
    by_perspective: &mut BTreeMap<u16, Learning>,
    settings: &Settings,
) -> Conclusion {
    let (teacher, language) = (examples.teacher, &examples.language);
    let shown = examples.shown.iter().map(|shown| Example::shown(teacher, shown.views.clone()));
    let task = Task { name: examples.title.clone().unwrap_or_default(), examples: shown.collect() };
    let (followed, open_question) = match decide_with(language, &task, newest, teacher, settings.on_conflict)
    {
        Decision::NoRule => (None, None),
        Decision::Followed(perspective) => (Some(perspective), None),
        Decision::Open(open) => (None, Some(open)),
    };
    let followed = followed.and_then(|perspective| Some((perspective, newest.get(&perspective)?.clone())));
    let mut inquiries = Vec::new();
    if let Some((perspective, learned)) = &followed
        && let Some(learning) = by_perspective.get_mut(perspective)
    {
        for rule in learned.primary() {
            let goal = rule.expectation.clone();
            let (question, demonstration) = (learning.inquire(&goal, 1), learning.inquire(&goal, OBJECTS));
            inquiries.push((goal, question, demonstration.filter(|asked| asked.objects.len() > 1)));
        }
    }
    Conclusion { followed, open_question, inquiries }
}

/// Reads a file, or standard input.
fn read(file: &Path) -> Result<Examples, ExamplesError> {
    if file == Path::new("-") {
        return Examples::read(stdin().lock(), "standard input");
    }
    let name = file.display().to_string();
    match File::open(file) {
        Ok(open) => Examples::read(BufReader::new(open), &name),
        Err(source) => Err(ExamplesError::File { name, source }),
    }
}
