//! `leo bus commission`: trials on real servos before Leo drives a body with them.

mod bench;
mod person;
mod report;
mod trials;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::Args;
use config::Robot;

use self::bench::Bench;
use self::person::{Person, Reply};
use self::report::{Outcome, Report};
use self::trials::{TRIALS, Trial};
use super::selection::BusSelection;
use super::{CommandError, output};

#[derive(Args, Clone, Debug)]
pub(super) struct Commission {
    /// Run the trials that need no person, without questions: torque comes on and joints move
    #[arg(long)]
    yes: bool,
    /// Only this trial; may be repeated
    #[arg(long, value_name = "TRIAL")]
    only: Vec<String>,
    /// The folder of the report, a new file named by the date
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    report: PathBuf,
}

impl Commission {
    pub(super) fn run(&self, place: &BusSelection<'_>, robot: &Robot) -> Result<ExitCode, CommandError> {
        let plan = self.plan()?;
        if place.buses().iter().any(|bus| bus.joints.is_empty()) {
            return Err(CommandError::usage(
                "the trials compare servos with the joints of motor.toml: add --bus to --device",
            ));
        }
        let stop = process::stop_flag().map_err(CommandError::runtime)?;
        let mut report = Report::create(&self.report, place)?;
        output::print(&format!("The report is {}.\n", report.path().display()))?;
        if !self.yes && plan.iter().any(|trial| trial.moves) {
            let asked = Person.ask(
                "Torque comes on, and each joint moves by up to 10 deg. The servos are mounted so that nothing falls, \
                 nobody is within reach, and a hand is at the switch of their power",
            )?;
            if asked == Reply::Skip {
                return Err(CommandError::runtime("nothing was tried"));
            }
        }
        for bus in place.buses() {
            let mut bench = Bench::new(bus, &robot.leo.motor, &stop);
            for (index, trial) in plan.iter().enumerate() {
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                let number = format!("Trial {} of {}", index + 1, plan.len());
                output::print(&format!(
                    "\n{number}, {}, {bus}\n  tried:    {}\n  expected: {}\n",
                    trial.name, trial.tries, trial.expects
                ))?;
                let outcome = bench.run(trial);
                output::print(&outcome.text())?;
                report.add(&bus.name, index + 1, trial, &outcome)?;
            }
            let off = bench.end();
            output::print(&format!("\n{bus}: {off}\n"))?;
            report.end_of_bus(&bus.name, &off)?;
        }
        self.conclude(&mut report, stop.load(Ordering::Relaxed))
    }

    /// The requested trials, in their order.
    fn plan(&self) -> Result<Vec<&'static Trial>, CommandError> {
        if let Some(unknown) = self.only.iter().find(|name| !TRIALS.iter().any(|trial| trial.name == **name))
        {
            let names: Vec<_> = TRIALS.iter().map(|trial| trial.name).collect();
            return Err(CommandError::usage(format!(
                "there is no trial `{unknown}`: use one of {}",
                names.join(", ")
            )));
        }
        let meant = |trial: &&Trial| self.only.is_empty() || self.only.iter().any(|name| *name == trial.name);
        let plan: Vec<_> =
            TRIALS.iter().filter(meant).filter(|trial| !(self.yes && trial.needs_person)).collect();
        if plan.is_empty() {
            return Err(CommandError::usage("that trial needs a person: omit --yes"));
        }
        Ok(plan)
    }

    fn conclude(&self, report: &mut Report, interrupted: bool) -> Result<ExitCode, CommandError> {
        let [passed, failed, skipped] =
            [Outcome::PASSED, Outcome::FAILED, Outcome::SKIPPED].map(|outcome| report.count(outcome));
        let left: Vec<_> =
            TRIALS.iter().filter(|trial| !report.has(trial.name)).map(|trial| trial.name).collect();
        report.conclude(interrupted, &left)?;
        let mut text = format!("\n{passed} passed, {failed} failed, {skipped} skipped");
        if interrupted {
            text += "; interrupted";
        }
        if !left.is_empty() {
            text += &format!(". Not tried, so the commissioning is not complete: {}", left.join(", "));
        }
        output::print(&format!("{text}.\nThe report is {}.\n", report.path().display()))?;
        let good = failed == 0 && skipped == 0 && !interrupted;
        Ok(if good { ExitCode::SUCCESS } else { ExitCode::from(1) })
    }
}
