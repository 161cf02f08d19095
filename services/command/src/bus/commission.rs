//! `leo bus commission`: trials on real servos before Leo drives a body with them.

mod bus_under_test;
mod outcome;
mod prompt;
mod report;
mod trials;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::Args;
use config::Robot;

use self::bus_under_test::BusUnderTest;
use self::outcome::Outcome;
use self::report::Report;
use self::trials::{TRIALS, Trial};
use super::selection::BusSelection;
use crate::failure::CommandError;
use crate::output::{self, confirm};

/// The question before the first trial that switches torque on.
const WARNING: &str = "WARNING: torque will come on and each joint moves by up to 10 deg. Confirm: the servos are mounted so \
                       that nothing falls, nobody is in reach, a hand is at the power switch";

#[derive(Args, Clone, Debug)]
pub(super) struct Commission {
    /// Run the trials that need no person, without questions: torque comes on and joints move
    #[arg(long)]
    yes: bool,
    /// Only this trial; may be repeated
    #[arg(long, value_name = "TRIAL")]
    only: Vec<String>,
    /// Folder for the report (a new file `commission-DATE.toml`)
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    report: PathBuf,
}

impl Commission {
    pub(super) fn run(&self, selection: &BusSelection<'_>, robot: &Robot) -> Result<ExitCode, CommandError> {
        let plan = self.plan()?;
        if selection.buses().iter().any(|bus| bus.joints.is_empty()) {
            return Err(CommandError::usage(
                "the trials compare servos with the joints of motor.toml: add --bus to --device",
            ));
        }
        if plan.iter().any(|trial| trial.uses_torque) {
            confirm(self.yes, WARNING)?;
        }
        // From here on Ctrl-C ends the trials, and torque goes off. At the question it ends the program.
        let stop = process::stop_flag().map_err(CommandError::runtime)?;
        let mut report = Report::create(&self.report, selection)?;
        output::print(&format!("The report is {}.\n", report.path().display()))?;
        for address in selection.buses() {
            let mut bus = BusUnderTest::new(address, &robot.leo.motor, &stop);
            let tried = try_all(&plan, &mut bus, &mut report);
            // Whatever failed, such as the disk of the report: no torque stays on, and standard error tells it.
            let off = bus.end();
            tried.map_err(|error| CommandError {
                text: format!("{}\n{address}: {off}", error.text),
                ..error
            })?;
            output::print(&format!("\n{address}: {off}\n"))?;
            report.end_of_bus(&address.name, &off)?;
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
        let is_selected =
            |trial: &&Trial| self.only.is_empty() || self.only.iter().any(|name| *name == trial.name);
        let plan: Vec<_> =
            TRIALS.iter().filter(is_selected).filter(|trial| !(self.yes && trial.needs_person)).collect();
        if plan.is_empty() {
            return Err(CommandError::usage("the selected trials need a person: omit --yes"));
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

/// Runs the trials on one bus until a signal, and prints and reports each.
fn try_all(
    plan: &[&'static Trial],
    bus: &mut BusUnderTest<'_>,
    report: &mut Report,
) -> Result<(), CommandError> {
    for (index, trial) in plan.iter().enumerate() {
        if bus.stop.load(Ordering::Relaxed) {
            break;
        }
        output::print(&format!(
            "\nTrial {} of {}, {}, {}\n  tried:    {}\n  expected: {}\n",
            index + 1,
            plan.len(),
            trial.name,
            bus.address,
            trial.tries,
            trial.expects
        ))?;
        let outcome = trial.run(bus);
        output::print(&outcome.text())?;
        report.add(&bus.address.name, index + 1, trial, &outcome)?;
    }
    Ok(())
}
