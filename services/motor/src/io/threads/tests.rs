use super::*;
use message::{JointCause, JointMode, JointState};
use mock_bus_process::MockBuses;
use serial::{LineLostError, Pty};
use servo::table::{BUS_WATCHDOG, Item, MOVING, TORQUE_ENABLE};
use servo::{Id, Instruction, Parser, Status};

mod campaign;
mod end;
mod fault_table;
mod killed;
mod progress_port;
mod rig;

use rig::{LONG, PERIOD, Rig, Time};

fn follows(state: &JointState) -> bool {
    state.mode() == Some(JointMode::Following)
}

#[test]
fn in_lockstep_65_joints_move_bit_for_bit_the_same() {
    let run = || {
        let mut rig = Rig::new(Time::Lockstep);
        let mut trace = String::new();
        for cycle in 0..700 {
            rig.cycle();
            if cycle % 100 == 99 {
                trace.push_str(&format!("{:?}\n", rig.motor.states().collect::<Vec<_>>()));
            }
        }
        assert_eq!(rig.motor.states().filter(follows).count(), 65);
        assert!(rig.motor.states().all(|state| rig.is_there()(&state)));
        assert_eq!(rig.motor.counts().stale, 0);
        trace
    };
    assert_eq!(run(), run());
}

#[test]
fn in_wall_time_joints_arrive_and_recover_from_lost_buses() {
    let mut rig = Rig::new(Time::Wall);
    rig.until("following", follows);
    let is_there = rig.is_there();
    rig.until("there", is_there);
    rig.ptys = None;
    rig.until("lost", |state| state.cause() == Some(JointCause::BusLost));
    rig.ptys = Some(MockBuses::open(&rig.robot.motor, rig.folder.path(), false).unwrap());
    rig.until("following again", follows);
}

#[test]
fn an_absent_bus_is_lost_after_25_cycles_and_stops_the_body() {
    let mut rig = Rig::new(Time::Wall);
    rig.until("following", follows);
    // Requests to this bus remain here, like with a device that hangs without a hang-up.
    let hung = Arc::new(JobSlot::new());
    let inbox = std::mem::replace(&mut rig.threads.workers[0].to, Arc::clone(&hung));
    rig.until_so("given to the one that hangs", |_| !hung.jobs.is_empty());
    for cycle in 1..MAX_SKIPPED {
        rig.cycle();
        assert!(!rig.motor.is_lost(0), "cycle {cycle}");
    }
    rig.cycle();
    assert!(rig.motor.is_lost(0));
    let is_on = |rig: &Rig, joint: &usize| rig.robot.motor.joints[*joint].bus == 0;
    let (lost, others): (Vec<usize>, Vec<usize>) = (0..65).partition(|joint| is_on(&rig, joint));
    let are = |rig: &Rig, joints: &[usize], cause| joints.iter().all(|&joint| rig.cause(joint) == cause);
    assert!(are(&rig, &lost, JointCause::BusLost));
    rig.until_so("stopped", |rig| are(rig, &others, JointCause::BodyStopped));
    // It still hangs, and is not counted again.
    for _ in 0..3 * MAX_SKIPPED {
        rig.cycle();
    }
    assert!(are(&rig, &lost, JointCause::BusLost));
    assert_eq!(rig.motor.bus_health(0).hang_ups, 1);
    inbox.jobs.push(hung.jobs.pop().unwrap()).unwrap();
    rig.threads.workers[0].to = inbox;
    rig.until("following again", follows);
    assert!(!rig.motor.is_lost(0));
}

#[test]
fn a_thread_reports_and_closes_a_blocked_line_by_itself() {
    let robot = config::Robot::load(None).unwrap();
    let bus = &robot.motor.buses[0];
    let pty = Pty::new(bus.baud).unwrap();
    let tty = Tty::open(pty.path(), bus.baud).unwrap();
    // Nothing reads the other end. The kernel moves data on for a while, which frees space.
    while tty.write(&[0; 64], clock::now() + Duration::from_millis(500)).is_ok() {}
    let reply_timeout = (PERIOD / 4, 2 * PERIOD);
    let line = Line::new(Some(tty), pty.path().to_owned(), bus.baud);
    let end = BusWorker::start(bus, line, reply_timeout, EmergencyFlag::default()).unwrap();
    let mut exchange = Box::<Exchange>::default();
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).unwrap();
    motor.request(0, clock::now(), &mut exchange.request);
    end.give(exchange).unwrap();
    let exchange = end.from.recv_timeout(LONG).unwrap();
    assert_eq!(exchange.replies.lost, Some(LineLostError::WriteTimeout));
    let give_up = clock::now() + LONG;
    while Tty::open(pty.path(), bus.baud).is_err() {
        assert!(clock::now() < give_up, "it is not closed");
        clock::sleep_until(clock::now() + PERIOD);
    }
}

/// Value of an item of a servo, read by another master after the first has gone.
fn item(tty: &Tty, id: u8, item: Item) -> i64 {
    let question = Instruction::Read { address: item.address, length: item.length };
    let mut bytes = [0; 64];
    let length = question.encode(Id::new(id).unwrap().into(), &mut bytes).unwrap();
    tty.write(&bytes[..length], clock::now() + LONG).unwrap();
    let mut parser = Parser::new();
    loop {
        let count = tty.read(&mut bytes, clock::now() + LONG).unwrap();
        parser.push(&bytes[..count]);
        while let Some(frame) = parser.next_frame() {
            let status = Status::parse(&frame);
            // The answer to the last question of the first master may still be on the line.
            if let Some(status) = status.filter(|status| status.params.len() == usize::from(item.length)) {
                let mut value = [0; 8];
                value[..status.params.len()].copy_from_slice(status.params);
                return i64::from_le_bytes(value);
            }
        }
    }
}

#[test]
fn servos_stop_by_themselves_after_the_commander_died() {
    let mut rig = Rig::new(Time::Wall);
    rig.until("following", follows);
    let moves = |state: JointState| state.present_velocity_rad_s().is_some_and(|speed| speed.abs() > 0.1);
    let is_there = rig.is_there();
    rig.until("there", is_there);
    rig.share = -0.5;
    let give_up = clock::now() + LONG;
    while rig.motor.states().filter(|state| moves(*state)).count() < 30 {
        rig.cycle();
        assert!(clock::now() < give_up, "they do not move");
    }
    // The commander disappears during the motion.
    rig.threads = BusThreads { workers: Vec::new(), max_skipped: MAX_SKIPPED };
    let silent_since = clock::now();
    // Any instruction on the bus would reset the watchdog. So nothing is sent during its timeout and the time a servo
    // needs to stop.
    clock::sleep_until(silent_since + Duration::from_millis(600));
    let mut tripped = 0;
    for (index, bus) in rig.robot.motor.buses.iter().enumerate() {
        let tty = Tty::open(&rig.folder.path().join(format!("bus-{}", bus.name)), bus.baud).unwrap();
        for joint in rig.robot.motor.joints.iter().filter(|joint| joint.bus == index) {
            assert_eq!(item(&tty, joint.id, BUS_WATCHDOG), 0xFF, "{}", joint.name);
            assert_eq!(item(&tty, joint.id, MOVING), 0, "{}", joint.name);
            assert_eq!(item(&tty, joint.id, TORQUE_ENABLE), 1, "{} holds", joint.name);
            tripped += 1;
        }
    }
    assert_eq!(tripped, 65);
}

#[test]
fn a_mock_bus_or_an_adapter_may_appear_after_the_motor() {
    let mut rig = Rig::new(Time::Wall);
    rig.ptys = None;
    let mut buses = rig.robot.motor.buses.clone();
    // A real device instead of the mock: only its path is known.
    let path = rig.folder.path().join(format!("bus-{}", buses[0].name));
    buses[0].device = Device::Tty(path);
    let (reply_timeout, calm) = ((PERIOD / 4, 2 * PERIOD), EmergencyFlag::default());
    rig.threads =
        BusThreads::start(&buses, rig.folder.path(), reply_timeout, Instant::EPOCH, true, &calm).unwrap();
    rig.until("lost", |state| state.cause() == Some(JointCause::BusLost));
    rig.ptys = Some(MockBuses::open(&rig.robot.motor, rig.folder.path(), false).unwrap());
    rig.until("following", follows);
}

#[test]
fn a_device_that_must_be_there_and_is_not_is_named() {
    let robot = config::Robot::load(None).unwrap();
    let started = BusThreads::start(
        &robot.motor.buses,
        Path::new("/nowhere"),
        (PERIOD, PERIOD),
        Instant::EPOCH,
        false,
        &EmergencyFlag::default(),
    );
    let error = started.unwrap_err();
    assert!(
        matches!(&error, ThreadError::Open { bus, source: OpenError::Device { path, .. } }
            if bus == "face_left" && path == Path::new("/nowhere/bus-face_left")),
        "{error:?}"
    );
}
