//! The study repeated with random blocks, and with different noise, cones and thresholds.

use std::fmt;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use config::Robot;
use quantity::number::saturating_u64;
use serde::Serialize;
use study::TaskVariant;

use crate::failure::CommandError;
use crate::progress::Progress;
use crate::rehearsal::rehearse;

/// Number of tasks of the study.
const TASKS: u32 = 4;
/// Maximum number of failed designs listed per setting and task.
const MAX_NAMED_DESIGNS: usize = 5;

/// The varied parameters, apart from the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Setting {
    /// Standard deviation of an observed position, in metres.
    position_sd_m: f64,
    /// Half angle of the partner's cone, in degrees.
    cone_half_angle_deg: f64,
    /// Distance below which beliefs are merged.
    threshold: f64,
}

const DEFAULT_SETTING: Setting = Setting { position_sd_m: 0.003, cone_half_angle_deg: 60.0, threshold: 0.15 };

const SETTINGS: [Setting; 7] = [
    DEFAULT_SETTING,
    Setting { position_sd_m: 0.010, ..DEFAULT_SETTING },
    Setting { position_sd_m: 0.030, ..DEFAULT_SETTING },
    Setting { cone_half_angle_deg: 30.0, ..DEFAULT_SETTING },
    Setting { cone_half_angle_deg: 89.0, ..DEFAULT_SETTING },
    Setting { threshold: 0.10, ..DEFAULT_SETTING },
    Setting { threshold: 0.20, ..DEFAULT_SETTING },
];

/// The robot under test, and the number of the simulator among its sources.
#[derive(Clone, Copy)]
struct RobotUnderTest<'a> {
    robot: &'a Robot,
    source: usize,
}

/// Success rate per setting and task.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Sweep {
    designs: u64,
    rows: Vec<Row>,
}

#[derive(Clone, Debug, Serialize)]
struct Row {
    setting: Setting,
    task: u32,
    /// Number of designs whose winner was right in both conditions.
    held: u64,
    /// The first failed designs, and what was learned instead.
    broken: Vec<FailedDesign>,
}

#[derive(Clone, Debug, Serialize)]
struct FailedDesign {
    design: u64,
    perspective_taking: bool,
    wanted: String,
    learned: String,
}

impl Sweep {
    /// Plays `designs` designs of every task in every setting, on all processors. `source` is the number of the
    /// simulator among the robot's sources.
    pub(super) fn of(robot: &Robot, source: usize, designs: u64) -> Result<Self, CommandError> {
        let rows = saturating_u64(SETTINGS.len()).saturating_mul(u64::from(TASKS));
        let progress = Progress::of_steps(rows.saturating_mul(designs));
        let mut rows = Vec::new();
        for setting in SETTINGS {
            let robot = setting.apply(robot)?;
            for task in 1..=TASKS {
                progress.say(format!("task {task}, {setting}"));
                let pupil = RobotUnderTest { robot: &robot, source };
                rows.push(Row::of(pupil, setting, task, designs, &progress)?);
            }
        }
        Ok(Self { designs, rows })
    }

    /// Whether all winners were right with up to 10 mm of noise, and at least 95 % with more.
    pub(super) fn holds(&self) -> bool {
        self.rows.iter().all(|row| row.held * 100 >= self.designs * row.setting.percent())
    }
}

impl Setting {
    fn apply(self, robot: &Robot) -> Result<Robot, CommandError> {
        let mut robot = robot.clone();
        let cone = self.cone_half_angle_deg.try_into().map_err(CommandError::runtime)?;
        robot.perspective.sight.cone_half_angle_deg = cone;
        robot.percepts.belief.threshold = self.threshold;
        Ok(robot)
    }

    /// The required success rate in percent.
    fn percent(self) -> u64 {
        if self.position_sd_m > 0.01 { 95 } else { 100 }
    }
}

impl Row {
    fn of(
        pupil: RobotUnderTest<'_>,
        setting: Setting,
        task: u32,
        designs: u64,
        progress: &Progress,
    ) -> Result<Self, CommandError> {
        let next = AtomicU64::new(0);
        let found = Mutex::new((0_u64, Vec::new(), None));
        let workers = thread::available_parallelism().map_or(1, usize::from);
        let work = || {
            loop {
                let design = next.fetch_add(1, Ordering::Relaxed);
                if design >= designs {
                    return;
                }
                let outcome = play(pupil, setting, task, design);
                progress.step();
                let mut found = found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                match outcome {
                    Ok(broken) if broken.is_empty() => found.0 += 1,
                    Ok(broken) => found.1.extend(broken),
                    Err(failed) => found.2 = Some(failed),
                }
            }
        };
        thread::scope(|scope| {
            for _ in 1..workers {
                // Without another thread, this one does all of the work.
                let _started = thread::Builder::new().spawn_scoped(scope, work);
            }
            work();
        });
        let (held, mut broken, failed) =
            found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(failed) = failed {
            return Err(failed);
        }
        broken.sort_by_key(|broken: &FailedDesign| (broken.design, broken.perspective_taking));
        broken.truncate(MAX_NAMED_DESIGNS);
        Ok(Self { setting, task, held, broken })
    }
}

/// Plays a design with and without perspective taking; returns the conditions with a wrong winner.
fn play(
    pupil: RobotUnderTest<'_>,
    setting: Setting,
    task: u32,
    design: u64,
) -> Result<Vec<FailedDesign>, CommandError> {
    let Some(TaskVariant { mut lesson, with, without, .. }) = TaskVariant::of(task, design) else {
        return Err(CommandError::runtime(format!("there is no design of task {task}")));
    };
    lesson.noise.position_sd_m = setting.position_sd_m;
    let mut broken = Vec::new();
    for (perspective_taking, wanted) in [(true, with), (false, without)] {
        let report = rehearse(pupil.robot, pupil.source, &lesson, u32::from(perspective_taking))?;
        let rule = report.tasks.first().and_then(|task| task.rule.as_ref());
        let learned = rule.map_or_else(|| "nothing".to_owned(), |rule| rule.name.clone());
        if learned != wanted {
            broken.push(FailedDesign { design, perspective_taking, wanted, learned });
        }
    }
    Ok(broken)
}

impl fmt::Display for Setting {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { position_sd_m, cone_half_angle_deg, threshold } = self;
        let noise_mm = position_sd_m * 1e3;
        write!(out, "noise {noise_mm:>2.0} mm, cone {cone_half_angle_deg:.0}°, threshold {threshold:.2}")
    }
}

impl fmt::Display for Sweep {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            out,
            "Designs of {} whose winner is right with and without perspective taking",
            self.designs
        )?;
        for row in &self.rows {
            let asked = format!("(asked: {} %)", row.setting.percent());
            writeln!(out, "  {:<42} task {}: {:>5} {asked}", row.setting.to_string(), row.task, row.held)?;
            for FailedDesign { design, perspective_taking, wanted, learned } in &row.broken {
                let how = if *perspective_taking { "with" } else { "without" };
                writeln!(out, "      design {design}, {how}: \"{learned}\" instead of \"{wanted}\"")?;
            }
        }
        Ok(())
    }
}
