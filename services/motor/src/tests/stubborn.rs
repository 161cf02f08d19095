//! Servos that do not acknowledge instructions, or become silent before they have received one.

use std::collections::BTreeMap;

use super::*;

use servo::Status;
use servo::mock::HardwareError;
use servo::table::{STATUS_RETURN_LEVEL, TORQUE_ENABLE};

use JointMode::{Following, Limp, Quarantined, Releasing};

use crate::bus::{Bus, Purpose};
use crate::job::Job;
use crate::joint::{Joint, Policy};
use config::leo::AlertReaction;

/// Instruction bytes of a ping, of a read and of a reboot.
const PING: u8 = 0x01;
const READ: u8 = 0x02;
const REBOOT: u8 = 0x08;

impl Rig {
    /// Cycles with a commander; returns their jobs.
    fn jobs_of(&mut self, cycles: u32) -> Vec<(usize, u8, u8)> {
        let mut jobs = Vec::new();
        for _ in 0..cycles {
            self.commanded(1, 0.2, self.now);
            jobs.extend_from_slice(&self.jobs);
        }
        jobs
    }

    /// Sets the status return level of a servo.
    fn level(&mut self, bus: usize, place: usize, level: u8) {
        self.servo(bus, place).write(STATUS_RETURN_LEVEL.address, &[level]).unwrap();
    }
}

/// A new motor process, and servos that are already configured, without torque.
fn configured() -> Rig {
    let Rig { mut lines, now, .. } = following();
    for servo in lines.iter_mut().flat_map(|line| &mut line.servos) {
        servo.write(TORQUE_ENABLE.address, &[0]).unwrap();
    }
    Rig { lines, now, ..Rig::new() }
}

/// The joints of the left bus in their initial state.
fn left_joints() -> [Joint; 2] {
    let robot = config::motor::parse(ROBOT, "motor.toml".as_ref()).unwrap();
    let policy = Policy::new(&config::parse(SETTINGS, "leo.toml".as_ref()).unwrap(), true);
    [0_u8, 1].map(|joint| {
        let settings = &robot.joints[usize::from(joint)];
        Joint::new(
            joint.into(),
            Id::new(settings.id).unwrap(),
            settings,
            policy.clone(),
            AlertReaction::Lower,
        )
    })
}

/// A status packet of servo 1 without errors.
fn status(params: &[u8]) -> Status<'_> {
    Status { id: Id::new(1).unwrap(), alert: false, fault: None, params }
}

/// A rig that reboots servos, whose elbow has just confirmed torque off after an alert.
fn alerted() -> Rig {
    let mut rig = Rig::with(&SETTINGS.replace("\"hold\"", "\"reboot\""));
    rig.until(200, 0.2, |rig| rig.modes() == [Following; 3]);
    rig.servo(0, 1).fail(HardwareError::Overheating);
    rig.until(10, 0.2, |rig| rig.modes()[1] == Limp);
    rig.commanded(10, 0.2, rig.now);
    assert_eq!(rig.torque(0, 1), 0);
    rig
}

#[test]
fn a_servo_without_power_before_its_reboot_costs_only_occasional_pings() {
    let mut rig = alerted();
    rig.mute.insert((0, 2));
    let jobs = rig.jobs_of(1500);
    let told = |instruction: Option<u8>| {
        let jobs = jobs.iter().filter(|(bus, id, _)| (*bus, *id) == (0, 2));
        jobs.filter(|(.., byte)| instruction.is_none_or(|instruction| instruction == *byte)).count()
    };
    assert_eq!(told(Some(REBOOT)), 1, "it may have heard it");
    assert!((4..12).contains(&told(None)), "asked {} times in six seconds", told(None));
    assert_eq!((rig.modes()[1], rig.causes()[1]), (Quarantined, JointCause::Silent));
    // The condition of the other servo is still read.
    rig.servo(0, 0).set_temperature(73.0);
    rig.until(150, 0.2, |rig| rig.causes()[0] == JointCause::Derated);
    rig.servo(0, 0).set_temperature(30.0);
    rig.mute.clear();
    rig.servo(0, 1).reboot();
    rig.until(2000, 0.2, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn a_reboot_with_a_lost_acknowledgement_is_sent_once() {
    let mut rig = alerted();
    rig.inject(0, "drop id=2");
    let mut reboots = 0;
    while reboots == 0 {
        reboots += rig.jobs_of(1).iter().filter(|(.., byte)| *byte == REBOOT).count();
    }
    rig.inject(0, "drop p=0");
    reboots += rig.jobs_of(500).iter().filter(|(.., byte)| *byte == REBOOT).count();
    assert_eq!((reboots, rig.modes()), (1, vec![Following; 3]));
}

#[test]
fn torque_off_is_retried_with_growing_delays() {
    let mut rig = following();
    rig.mute.insert((0, 2));
    rig.lines[0].servos[1].fail(HardwareError::Overheating);
    // It reports the alert in one answer, and then becomes silent.
    rig.mute.clear();
    rig.commanded(1, 0.2, rig.now);
    rig.mute.insert((0, 2));
    assert_eq!(rig.modes()[1], Releasing);
    let told = rig.jobs_of(1500).iter().filter(|(bus, id, _)| (*bus, *id) == (0, 2)).count();
    assert!((4..30).contains(&told), "told {told} times in six seconds");
    assert_eq!(rig.modes()[1], Releasing, "it has not said so");
}

#[test]
fn servos_are_inspected_while_another_has_a_job_every_cycle() {
    let (rig, mut joints) = (following(), left_joints());
    // The first servo is set up. The second never gets an answer, so that it is pinged forever.
    let servo = &rig.lines[0].servos[0];
    for (job, params) in [(Job::Ping, &servo.ping()[..]), (Job::Inspect, servo.read(9, 107).unwrap())] {
        joints[0].process_answer(rig.now, job, &status(params));
    }
    let (mut bus, mut request) = (Bus::new(vec![0, 1], true), Request::default());
    let mut asked = BTreeMap::new();
    for cycle in 0..500 {
        let now = rig.now + cycle * PERIOD;
        bus.plan(now, &mut joints, Purpose::Drive { arm_up_to: None }, &mut request);
        for (part, bytes) in
            request.parts().filter(|(part, _)| matches!(part.kind, PartKind::Job | PartKind::ReadCondition))
        {
            *asked.entry((part.ids()[0], bytes[7])).or_insert(0) += 1;
        }
    }
    // Twice a second.
    assert_eq!(asked, BTreeMap::from([((1, READ), 4), ((2, PING), 496)]));
}

#[test]
fn a_servo_without_status_replies_is_reconfigured_and_follows() {
    for level in [0, 1] {
        let mut rig = configured();
        rig.level(0, 0, level);
        rig.commanded(150, 0.3, rig.now);
        assert_eq!(rig.modes(), [Following; 3], "level {level}");
        assert_eq!(rig.servo(0, 0).status_return_level(), 2);
    }
}

#[test]
fn a_servo_that_stops_acknowledging_still_switches_torque_off() {
    let mut rig = following();
    rig.level(0, 0, 1);
    rig.commanded(150, 0.3, rig.now);
    // Without a commander.
    for _ in 0..400 {
        rig.cycle();
    }
    assert_eq!((rig.modes(), rig.torque(0, 0)), (vec![Limp; 3], 0));
    rig.commanded(150, 0.3, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn a_readable_servo_that_never_acknowledges_is_quarantined() {
    let mut rig = configured();
    let mut quarantined = 0;
    for _ in 0..400 {
        rig.level(0, 0, 1);
        rig.commanded(1, 0.3, rig.now);
        quarantined += u32::from(rig.modes()[0] == Quarantined);
        assert_eq!(rig.torque(0, 0), 0);
    }
    assert!(quarantined > 200, "in {quarantined} cycles of 400");
    assert_eq!(rig.modes()[1..], [Following; 2]);
    rig.level(0, 0, 2);
    rig.until(1500, 0.3, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn the_status_return_level_of_a_servo_is_read_back() {
    let (rig, [mut joint, _]) = (following(), left_joints());
    let servo = &rig.lines[0].servos[0];
    joint.process_answer(rig.now, Job::Ping, &status(&servo.ping()));
    let mut setup = servo.read(9, 107).unwrap().to_vec();
    setup[usize::from(STATUS_RETURN_LEVEL.address - 9)] = 1;
    for _ in 0..3 {
        assert_eq!(joint.job(rig.now, true), Some(Job::Inspect), "it did not hear it");
        joint.process_answer(rig.now, Job::Inspect, &status(&setup));
    }
    assert_eq!(joint.state().mode(), Some(Quarantined));
}
