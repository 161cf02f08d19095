//! All faults at once over pseudo-terminals, in wall time.

use config::leo::OnAlert;

use super::*;
use crate::motor::MAX_STEP;
use crate::tests::campaign::{
    Commands, FaultTargets, ROUND, check_causes, check_servo, faults, is_back, is_held_up, swing, waits,
};

/// The realtime tick counts milliseconds modulo this value.
const WRAP_MS: f64 = 32_768.0;
/// Resolution of the tick, in milliseconds.
const RESOLUTION_MS: f64 = 1.0;
/// Longest time for all joints to recover, on a loaded machine.
const BACK: Duration = Duration::from_secs(60);

/// Maximum age of a reading of a servo that counts as present.
const FRESH: Duration = Duration::from_millis(100);

/// Counters of a campaign.
#[derive(Debug, Default)]
struct Seen {
    cycles: u64,
    readings: u64,
    away: u64,
}

/// Last readings and setpoints.
struct Last {
    asked_at: Vec<Instant>,
    commands: Commands,
    struck: FaultTargets,
    /// When the round began.
    round_at: Instant,
}

/// Whether a reading with this tick was sampled before it was requested, if the servo's clock started at
/// `started_at`.
fn is_stale(tick_ms: u16, started_at: Instant, asked_at: Instant) -> bool {
    let behind_ms = asked_at.since(started_at).as_secs_f64() * 1e3 - f64::from(tick_ms) - RESOLUTION_MS;
    (behind_ms + WRAP_MS / 2.0).rem_euclid(WRAP_MS) > WRAP_MS / 2.0
}

/// A cycle in which every accepted reading and every setpoint is checked.
fn cycle(rig: &mut Rig, last: &mut Last, seen: &mut Seen) {
    let stepped_at = rig.now;
    rig.cycle();
    seen.cycles += 1;
    let dt_s = rig.now.since(stepped_at).min(MAX_STEP).as_secs_f64();
    last.commands.check(dt_s, rig.motor.states(), &rig.robot.motor.joints);
    last.struck.note(rig.now.since(last.round_at), rig.motor.states(), &rig.robot.motor.joints);
    check_causes(rig.motor.states(), &rig.robot.motor);
    for (index, (state, joint)) in rig.motor.states().zip(&rig.robot.motor.joints).enumerate() {
        last.commands.obeyed += u64::from(rig.servo(index, |servo| check_servo(servo, joint)));
        seen.away += u64::from(!follows(&state));
        let Some((asked_at, reading)) = rig.motor.reading(index).filter(|read| read.0 > last.asked_at[index])
        else {
            continue;
        };
        last.asked_at[index] = asked_at;
        let started_at = rig.servo(index, |servo| servo.started_at());
        // A servo that has restarted since then has another clock.
        if started_at < asked_at && last.struck.has_clock(index) {
            seen.readings += 1;
            assert!(
                !is_stale(reading.tick_ms, started_at, asked_at),
                "{} believes {reading:?}, asked for {} ms after the servo began, {state:?}",
                joint.name,
                asked_at.since(started_at).as_secs_f64() * 1e3
            );
        }
    }
}

/// Joints that have not recovered, and their states.
fn lost(rig: &Rig) -> Vec<(&str, JointState)> {
    let joints = rig.motor.states().zip(&rig.robot.motor.joints).enumerate();
    let is_lost = |(index, (state, joint)): &(usize, (JointState, &config::motor::Joint))| {
        !rig.servo(*index, |servo| is_back(state, joint, servo, rig.now - FRESH))
    };
    joints.filter(is_lost).map(|(_, (state, joint))| (joint.name.as_str(), state)).collect()
}

fn campaign(lasts: Duration) {
    let mut robot = config::Robot::load(None).unwrap();
    robot.leo.motor.on_alert = OnAlert::Reboot;
    let mut rig = Rig::of(robot, Time::Wall, &EmergencyFlag::default());
    rig.until("following", follows);
    let skipped = |rig: &Rig| rig.threads.exchange_stats().map(|(skipped, _)| skipped).sum::<u64>();
    let skipped_before = skipped(&rig);
    assert_eq!(rig.motor.states().len(), 65);
    let faults = faults();
    let struck = FaultTargets::new(&faults, &rig.robot.motor);
    let (asked_at, commands) = (vec![Instant::EPOCH; 65], Commands::new(65));
    let mut last = Last { asked_at, commands, struck, round_at: rig.now };
    let mut seen = Seen::default();
    let end = clock::now() + lasts;
    while clock::now() < end {
        rig.ptys.as_ref().unwrap().inject(&[]);
        rig.ptys.as_ref().unwrap().inject(&faults);
        last.round_at = clock::now();
        while clock::now() < last.round_at + ROUND {
            rig.goals = Some(swing(rig.now, &rig.robot.motor.joints));
            cycle(&mut rig, &mut last, &mut seen);
        }
        last.struck.end_round();
        if rig.motor.states().any(|state| waits(&state)) {
            rig.motor.recover();
        }
    }
    let (stale, skipped) = (rig.motor.counts().stale, skipped(&rig) - skipped_before);
    println!("{seen:?}, {stale} stale answers dropped, {skipped} requests left out");
    assert!(seen.away > 0 && stale > 0, "the faults did nothing");
    // An overloaded machine skips requests. Of the requests sent, to 13 servos each, most readings must arrive.
    let requests = 5 * seen.cycles - skipped;
    assert!(seen.readings > 13 * requests / 2, "{seen:?}, {requests} requests");
    let FaultTargets { times, moving, .. } = last.struck;
    println!("{moving} of {times} struck as they moved");
    assert!(2 * moving > times, "{moving} of {times} were struck as they moved");
    rig.ptys.as_ref().unwrap().inject(&[]);
    let mut until = |rig: &mut Rig, holds: fn(&[(&str, JointState)]) -> bool| {
        let give_up = clock::now() + BACK;
        while !holds(&lost(rig)) {
            cycle(rig, &mut last, &mut seen);
            assert!(clock::now() < give_up, "not everybody is back: {:?}", lost(rig));
        }
    };
    until(&mut rig, |lost| lost.iter().all(|(_, state)| is_held_up(state)));
    if rig.motor.states().any(|state| waits(&state)) {
        rig.motor.recover();
    }
    until(&mut rig, |lost| lost.is_empty());
    let Commands { compared, obeyed, .. } = last.commands;
    assert!(compared.min(obeyed) > 65 * seen.cycles / 2, "{compared} and {obeyed} of {seen:?}");
}

#[test]
fn ten_seconds_of_every_fault_at_once_for_real() {
    campaign(ROUND);
}

/// `cargo test --release -p motor-process a_minute -- --ignored --nocapture`
#[test]
#[ignore = "takes a minute"]
fn a_minute_of_every_fault_at_once_for_real() {
    campaign(6 * ROUND);
}

/// The same for ten minutes: `ten_minutes`.
#[test]
#[ignore = "takes ten minutes"]
fn ten_minutes_of_every_fault_at_once_for_real() {
    campaign(Duration::from_secs(600));
}

#[test]
fn a_sample_older_than_its_request_is_stale() {
    let ms = |ms| Instant::EPOCH + Duration::from_millis(ms);
    assert!(!is_stale(100, ms(0), ms(100)));
    assert!(!is_stale(103, ms(0), ms(100)));
    assert!(is_stale(90, ms(0), ms(100)));
    assert!(!is_stale(1, ms(0), ms(32_768)), "the tick wraps");
    assert!(is_stale(32_758, ms(0), ms(32_768)));
}
