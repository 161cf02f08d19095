//! One joint, its servo on a mock line, and exchanges with faults.
#![expect(clippy::wildcard_enum_match_arm, reason = "a fault concerns few of the things that can go wrong")]

use super::*;

use servo::{Fault, Parser, Status};

use crate::job::CONDITION;

/// One joint on one simulated bus. Its limits are ±1 rad.
pub(super) const ONE_JOINT: &str = r#"
bus = [{ name = "left", device = "/dev/ttyUSB0", baud = 4000000 }]
[[joint]]
name = "shoulder"
bus = "left"
id = 1
model = "XM430-W350"
sign = 1
offset_rad = 0.0
min_rad = -1.0
max_rad = 1.0
max_velocity_rad_s = 2.0
max_acceleration_rad_s2 = 10.0
group = "body"
"#;

/// Short times, so that few cycles reach what follows. Joints are armed only by orders.
pub(super) const SHORT: &str = "rate_hz = 250\ncommand_timeout_ms = 20\nlimp_after_ms = 20\n\
                     reply_timeout_ms = 1\nsoft_start_ms = 12\nsoft_start_rad_s = 0.5\non_alert = \"hold\"\n\
                     automatic_arming = \"never\"\nstop_category = 0\nmax_tracking_error_rad = 0.3\n\
                     blocked_after_ms = 20\nmax_beyond_limits_rad = 1.0\n\
                     alert = { input_voltage = \"lower\", overheating = \"limp\", encoder = \"hold\", \
                     electrical_shock = \"limp\", overload = \"limp\", groups = {}, hold_ms = 12, \
                     lower_timeout_ms = 60 }\n\
                     realtime = { fifo_priority = 0, cores = [], lock_memory = false }";

/// The commander's goal.
pub(super) const GOAL_RAD: f64 = 0.5;
/// Firmware without fast sync reads: each servo answers separately.
const FIRMWARE: u8 = 40;

/// Fault of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExchangeFault {
    Nothing,
    /// The servo receives nothing.
    Deaf,
    /// The servo executes instructions, but none of its answers arrives.
    Mute,
    /// The servo does not receive the job.
    JobUnheard,
    /// The servo receives one of the two instructions of a job.
    JobFirstHalf,
    JobSecondHalf,
    /// The servo executes the job; its answer is lost or corrupt.
    JobUnanswered,
    JobBroken,
    /// The servo refuses the job, or reports a wrong check sum.
    JobRefused,
    JobChecksum,
    /// The measurements are stale, lost, or corrupt.
    ReadingStale,
    ReadingUnanswered,
    ReadingBroken,
    LineLost,
}

/// Carries out a request like the master of a bus.
pub(super) fn exchange(
    line: &mut Line,
    now: Instant,
    wrong: ExchangeFault,
    request: &Request,
    replies: &mut Replies,
) {
    replies.clear();
    replies.stamp(now);
    line.advance(now);
    if wrong == ExchangeFault::LineLost {
        replies.lost = Some(LineLostError::HangUp);
        return;
    }
    let mut has_alert = false;
    for (part, bytes) in request.parts() {
        let id = Id::new(1).unwrap();
        let is_job = matches!(part.kind, PartKind::Job | PartKind::ReadCondition);
        let is_unasked = part.kind == PartKind::ReadCondition && !replies.has_from(id.get());
        if wrong == ExchangeFault::Deaf || is_unasked || (is_job && wrong == ExchangeFault::JobUnheard) {
            continue;
        }
        let fault = match wrong {
            ExchangeFault::JobRefused if is_job => Some(Fault::Access),
            ExchangeFault::JobChecksum if is_job => Some(Fault::Checksum),
            _ => None,
        };
        if fault.is_some() {
            replies.add(part.kind, &Status { id, alert: false, fault, params: &[] });
            continue;
        }
        let second =
            bytes[1..].windows(4).position(|window| window == [0xFF, 0xFF, 0xFD, 0]).map(|at| at + 1);
        let bytes = match (wrong, second) {
            (ExchangeFault::JobFirstHalf, Some(second)) if is_job => &bytes[..second],
            (ExchangeFault::JobSecondHalf, Some(second)) if is_job => &bytes[second..],
            _ => bytes,
        };
        let mut heard = Vec::new();
        line.hear(now, bytes, &mut heard);
        let is_lost = match wrong {
            ExchangeFault::Mute => true,
            ExchangeFault::JobUnanswered | ExchangeFault::JobBroken => is_job,
            ExchangeFault::ReadingUnanswered | ExchangeFault::ReadingBroken => {
                part.kind == PartKind::PlainRead
            }
            _ => false,
        };
        if is_lost {
            let is_corrupt = matches!(wrong, ExchangeFault::JobBroken | ExchangeFault::ReadingBroken);
            replies.record(part.kind, |part| part.corrupt += u32::from(is_corrupt));
            continue;
        }
        let mut parser = Parser::new();
        parser.push(&heard);
        while let Some(frame) = parser.next_frame() {
            let Some(status) = Status::parse(&frame) else { continue };
            let mut params = status.params.to_vec();
            if wrong == ExchangeFault::ReadingStale && part.kind == PartKind::PlainRead {
                let tick = u16::from_le_bytes([params[0], params[1]]);
                let old = (tick + 32_768 - 300) % 32_768;
                params[..2].copy_from_slice(&old.to_le_bytes());
            }
            has_alert |= status.alert;
            replies.record(part.kind, |part| part.bytes += heard.len());
            replies.add(part.kind, &Status { params: &params, ..status });
        }
    }
    if has_alert {
        let servo = &line.servos[0];
        let params = servo.read(CONDITION.address, CONDITION.length).unwrap().to_vec();
        let id = Id::new(servo.id()).unwrap();
        replies.add(PartKind::AlertCondition, &Status { id, alert: true, fault: None, params: &params });
    }
}

/// Whether a request sends goals.
pub(super) fn sends_goals(request: &Request) -> bool {
    let goals = [0x83, table::PROFILE_VELOCITY.address.to_le_bytes()[0], 0, 8, 0];
    request.parts().any(|(_, bytes)| bytes.windows(goals.len()).any(|window| window == goals))
}

/// A byte of the servo's control table.
pub(super) fn item(line: &Line, item: table::Item) -> u8 {
    line.servos[0].read(item.address, 1).unwrap()[0]
}

pub(super) fn one_servo() -> Line {
    let servo = Servo::new(Model::Xm430W350, Id::new(1).unwrap(), 0.2, Instant::EPOCH);
    Line::new(vec![servo.with_firmware(FIRMWARE)])
}

/// Moves the servo by hand.
pub(super) fn push_to(line: &mut Line, to_rad: f64) {
    let servo = &mut line.servos[0];
    servo.displace(to_rad - servo.position_rad());
}
