use std::fmt;
use std::path::Path;

use crate::{Bus, LineError};

/// Result of switching torque off.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[must_use = "servos that may still have torque must be named"]
pub struct Report {
    /// Number of servos that confirmed torque off.
    pub confirmed: usize,
    /// Servos that did not confirm.
    pub unconfirmed: Vec<UnconfirmedServo>,
}

/// A servo that has not confirmed torque off.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("torque may still be on of {joint} (bus {bus}, id {id}): {cause}")]
pub struct UnconfirmedServo {
    /// The joint that it drives.
    pub joint: String,
    /// The bus it is on.
    pub bus: String,
    /// Its identifier on the bus.
    pub id: u8,
    /// Why it has not confirmed.
    pub cause: Cause,
}

/// Why a servo has not confirmed torque off.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Cause {
    /// It does not answer.
    #[error("it does not answer")]
    Silent,
    /// Its torque is still on, although it was told to switch it off.
    #[error("it says that its torque is on")]
    On,
    /// Its line cannot be used.
    #[error("{0}")]
    Line(LineError),
}

impl Report {
    pub(crate) fn add(&mut self, bus: &Bus, causes: &[Option<Cause>]) {
        for (servo, cause) in bus.servos.iter().zip(causes) {
            match cause {
                None => self.confirmed += 1,
                Some(cause) => self.unconfirmed.push(UnconfirmedServo {
                    joint: servo.joint.clone(),
                    bus: bus.name.clone(),
                    id: servo.id,
                    cause: cause.clone(),
                }),
            }
        }
    }

    /// Whether every servo confirmed torque off.
    #[must_use]
    pub const fn is_confirmed(&self) -> bool {
        self.unconfirmed.is_empty()
    }

    /// Advice for an operator if torque off is not confirmed. `config` is the path of the robot's `leo.toml`.
    #[must_use]
    pub fn advice(config: Option<&Path>) -> String {
        let file = config.map_or_else(|| "FILE".to_owned(), |file| file.display().to_string());
        format!(
            "cut the power if anything moves; `leo bus torque off --config {file}` tries again once no robot runs"
        )
    }

    /// Logs the result: one line if all servos confirmed, otherwise a line for each that did not, and advice for the
    /// operator.
    pub fn log(&self, config: Option<&Path>) {
        if self.is_confirmed() {
            tracing::warn!("{self}");
            return;
        }
        for servo in &self.unconfirmed {
            tracing::error!("{servo}");
        }
        tracing::error!("{self}: {}", Self::advice(config));
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.confirmed + self.unconfirmed.len();
        write!(out, "{} of {all} servos say that their torque is off", self.confirmed)
    }
}
