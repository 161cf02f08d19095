//! Readers of beliefs in other languages, with a real robot.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use belief::percepts::{Percepts, Space};
use leo_reader::Reader;
use message::{Belief, Name, Symbols};
use rustix::process::Signal;
use tempfile::TempDir;

use crate::one_robot;
use crate::python::Python;
use crate::robot::{Robot, signal, wait_until};

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/examples");
/// Of the partner, in `leo.toml`.
const PARTNER: &str = "Änne";
/// The partner's topic is opened after the first round, and has frames from the next one on.
const ROUNDS: &str = "3";

/// The printed class of each belief, by the name of its perspective and its identity.
type Printed = BTreeMap<String, BTreeMap<u64, String>>;

/// The folder of this test, where Cargo puts the library for C too.
fn libraries() -> PathBuf {
    let test = std::env::current_exe().expect("its own path");
    test.parent().expect("a folder").to_owned()
}

/// A compiled example.
struct Program(TempDir);

impl Program {
    /// The example in C; `None` if the machine has no compiler.
    fn c() -> Option<Self> {
        Self::compile("cc", &["-std=c11", "-Wpedantic"], "c/read_beliefs.c")
    }

    /// The example in C++; `None` if the machine has no compiler.
    fn cpp() -> Option<Self> {
        Self::compile("c++", &["-std=c++17"], "cpp/read_beliefs.cpp")
    }

    fn compile(compiler: &str, options: &[&str], source: &str) -> Option<Self> {
        let (libraries, program) = (libraries(), Self(tempfile::tempdir().expect("a folder")));
        let output = Command::new(compiler)
            .args(options)
            .args(["-Wall", "-Wextra", "-Werror", &format!("-I{EXAMPLES}/c"), "-o"])
            .arg(program.path())
            .arg(format!("{EXAMPLES}/{source}"))
            .arg(format!("-L{}", libraries.display()))
            .arg("-lleo_reader")
            .arg(format!("-Wl,-rpath,{}", libraries.display()))
            .output();
        let Ok(output) = output else {
            skip::skip(format!("there is no compiler `{compiler}` here"));
            return None;
        };
        assert!(output.status.success(), "{compiler}: {}", String::from_utf8_lossy(&output.stderr));
        Some(program)
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("read_beliefs")
    }

    /// To be run with the domain of a robot.
    fn command(&self, domain: &Path) -> Command {
        let mut command = Command::new(self.path());
        command.arg(domain).arg(ROUNDS);
        command
    }
}

/// Runs a reader to its end; its output.
fn said(mut reader: Command) -> String {
    let Output { status, stdout, stderr } = reader.output().expect("starts");
    assert!(status.success(), "{reader:?}: {status}\n{}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).expect("UTF-8")
}

/// What a reader printed: `NAME:` for each perspective, and `  3: yellow square at (…), seen …` for each belief.
fn printed(text: &str) -> Printed {
    let mut printed = Printed::new();
    let mut perspective = String::new();
    for line in text.lines() {
        match line.strip_prefix("  ") {
            None => perspective = line.strip_suffix(':').expect("the name of a perspective").to_owned(),
            Some(belief) => {
                let (id, rest) = belief.split_once(": ").expect("an identity");
                let (class, rest) = rest.split_once(" at (").expect("a position");
                let (position, rest) = rest.split_once("), seen ").expect("three numbers");
                assert_eq!(position.split(", ").filter_map(|m| m.parse::<f64>().ok()).count(), 3, "{line}");
                let (times, age) = rest.split_once(" times, ").expect("a count");
                let age = age.strip_suffix(" s ago").and_then(|age| age.parse::<f64>().ok());
                assert!(times.parse::<u64>().is_ok_and(|times| times > 0) && age >= Some(0.0), "{line}");
                let beliefs = printed.entry(perspective.clone()).or_default();
                beliefs.insert(id.parse().expect("a number"), class.to_owned());
            }
        }
    }
    printed
}

/// The class of a belief by the configuration: "yellow square".
fn class(percepts: &Percepts, belief: &Belief) -> String {
    let class = percepts.nearest_in(Space::Colour).chain(percepts.nearest_in(Space::Shape));
    let names = class.filter_map(|number| {
        let symbol = usize::from(belief.symbol(number)?);
        percepts.get(number)?.symbols().nth(symbol)
    });
    let names: Vec<_> = names.collect();
    if names.is_empty() { "thing".to_owned() } else { names.join(" ") }
}

/// The class of each belief in the newest frame of a perspective, once there are some.
fn believed(reader: &mut Reader, percepts: &Percepts, perspective: u32) -> BTreeMap<u64, String> {
    let mut found = BTreeMap::new();
    let came = wait_until(|| {
        let count = reader.next(perspective).expect("works").map_or(0, |(_, count)| count);
        let beliefs = (0..count).filter_map(|index| reader.belief(index));
        found = beliefs.map(|belief| (belief.id, class(percepts, belief))).collect();
        !found.is_empty()
    });
    assert!(came, "perspective {perspective} has no beliefs");
    found
}

/// Names and incarnation of the next frame of the robot's beliefs that `is_wanted` accepts.
fn symbols(reader: &mut Reader, is_wanted: impl Fn(u64) -> bool) -> (u64, Symbols) {
    let mut found = None;
    let came = wait_until(|| {
        let head = reader.next(0).expect("works").map(|(head, _)| head);
        let incarnation = head.map(|head| head.header.incarnation).filter(|number| is_wanted(*number));
        found = incarnation.and_then(|number| Some((number, reader.symbols(number)?)));
        found.is_some()
    });
    assert!(came, "no names for the robot's beliefs");
    found.expect("waited for")
}

#[test]
fn readers_in_three_languages_print_beliefs_with_names() {
    let _alone = one_robot();
    let Some(python) = Python::find() else { return };
    let (Some(c), Some(cpp)) = (Program::c(), Program::cpp()) else { return };
    let robot = Robot::ready("sources", &[("names", &format!("[{PARTNER:?}]"))]);
    let mut reader = Reader::open(robot.domain()).expect("joins");
    let percepts = Percepts::builtin();

    let (_, names) = symbols(&mut reader, |_| true);
    assert_eq!(names.agents().iter().map(Name::as_str).collect::<Vec<_>>(), ["Leo", PARTNER]);
    let (own, partners) = (believed(&mut reader, &percepts, 0), believed(&mut reader, &percepts, 1));
    let options = ["--rounds", ROUNDS, "--domain"];
    let programs = [
        ("Python", python.run("docs/examples/python/read_beliefs.py", &options, robot.domain())),
        ("C", c.command(robot.domain())),
        ("C++", cpp.command(robot.domain())),
    ];
    for (language, program) in programs {
        let text = said(program);
        let printed = printed(&text);
        for (name, expected) in [("Leo", &own), (PARTNER, &partners)] {
            let of_it = printed.get(name).unwrap_or_else(|| panic!("{language}: {text}"));
            let common: Vec<_> = of_it.iter().filter(|(id, _)| expected.contains_key(id)).collect();
            assert!(!common.is_empty(), "{language}, {name}: {expected:?}\n{text}");
            for (id, class) in common {
                assert_eq!(Some(class), expected.get(id), "{language}, {name}: {text}");
            }
        }
    }

    let counted = said(python.run("tests/sources/count_elements.py", &[], robot.domain()));
    let counted: Vec<usize> =
        counted.split_whitespace().map(|number| number.parse().expect("a number")).collect();
    let &[length, elements, size] = counted.as_slice() else { panic!("{counted:?}") };
    assert_eq!(
        (length, size),
        (elements * size, size_of::<Belief>()),
        "the length of a slice is one of bytes"
    );
    assert!(elements > 1);
}

#[test]
fn names_belong_to_beliefs_after_a_restart_of_their_process() {
    let _alone = one_robot();
    let robot = Robot::ready("sources", &[]);
    let mut reader = Reader::open(robot.domain()).expect("joins");
    let (first, before) = symbols(&mut reader, |_| true);
    assert_eq!(before.percepts().len(), Percepts::builtin().percepts.len());
    assert_eq!(reader.symbols(first + 1), None, "this incarnation does not exist");

    signal(robot.processes()["belief"], Signal::KILL);
    let (second, after) = symbols(&mut reader, |incarnation| incarnation != first);
    assert!(second > first, "{second}");
    // A restarted process reads the configuration of the start.
    assert!(before == after);
}

#[test]
fn a_reader_in_c_without_a_robot_names_the_remedy() {
    let Some(program) = Program::c() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let output = program.command(folder.path()).output().expect("starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("is no domain of Leo") && said.contains("`leo run`"), "{said}");
}
