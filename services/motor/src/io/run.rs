use clock::{Duration, Instant};
use config::Robot;
use config::motor::Device;
use invariant::require;
use message::{Header, Hop, JointCause, JointGoals, JointMode, JointState, JointStates, Process};
use process::arming::Arming;
use process::{Emergency, EmergencyFlag, Launch, ProcessError, ProcessNode, Progress};
use transport::FramePublisher;

use crate::Motor;
use crate::io::ending;
use crate::io::health_publisher::HealthPublisher;
use crate::io::threads::BusThreads;
use crate::reporter::Reporter;

/// Maximum duration of the orderly end: decelerate, hold, torque off.
const END_WITHIN: Duration = Duration::from_secs(1);
/// Time after which the orderly end switches torque off even if joints still move, so that no torque is left on.
const LET_GO_AFTER: Duration = Duration::from_millis(750);
/// Reply timeout of the mock bus where the machine gives no real-time priority. A busy laptop lets a process wait for
/// tens of milliseconds.
const PATIENT_REPLY_TIMEOUT: Duration = Duration::from_millis(250);
/// Number of consecutive cycles after which such a bus is lost: two seconds at 250 Hz.
const PATIENT_CYCLES: u32 = 500;

/// Runs the motor process until it is told to stop. Then the joints decelerate and hold, and torque goes off.
///
/// # Errors
///
/// The configuration is invalid, or a device is no serial line or is in use. Or the domain cannot be joined, or the
/// middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let mut member = ProcessNode::join(launch, Process::Motor, &leo.buffers, &leo.motor.realtime)
        .map_err(|failure| ending::could_not_join(failure, launch, robot))?;
    let mut goals = member.subscriber::<JointGoals>(None)?;
    let mut states = member.publisher::<JointStates>(None, robot.motor.joints.len())?;
    let names: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
    let parents = kinematics::nearest_ancestors(&robot.urdf, &names).map_err(ProcessError::own)?;
    let mut motor = Motor::new(&robot.motor, &leo.motor).map_err(ProcessError::own)?.with_parents(&parents);
    let is_patient = waits_for_mock_bus(&member, launch, robot);
    let mut reporter = Reporter::new(robot, launch.campaign.is_some()).with_patience(is_patient);
    let period = leo.motor.rate_hz.period();
    let step_timeout = leo.supervisor.step_timeout_ms.duration();
    // In lockstep a slow machine must not look like a silent servo.
    let reply_timeout = if launch.lockstep {
        (step_timeout / 4, step_timeout / 4)
    } else if is_patient {
        (PATIENT_REPLY_TIMEOUT, PATIENT_REPLY_TIMEOUT)
    } else {
        (leo.motor.reply_timeout_ms.duration(), 2 * period)
    };
    // In lockstep the mock servo bus must answer in every step. Otherwise a device may be plugged in later.
    let until = clock::now() + leo.supervisor.ready_timeout_ms.duration() / 2;
    // There is no emergency stop in simulated time.
    let emergency = if launch.lockstep { None } else { Some(Emergency::watch(&launch.domain)?) };
    let arming = if launch.lockstep { None } else { Some(Arming::watch(&launch.domain)?) };
    let emergency_flag = emergency.as_ref().map(Emergency::emergency_flag).unwrap_or_default();
    let buses = &robot.motor.buses;
    let mut threads =
        BusThreads::start(buses, &launch.domain, reply_timeout, until, !launch.lockstep, &emergency_flag)
            .map_err(ProcessError::own)?;
    if is_patient {
        threads = threads.with_max_skipped(PATIENT_CYCLES);
    }
    let mut health_publisher = HealthPublisher::new(member.board()?, member.board()?, robot);
    let mut failed = None;
    member.begin(Some(period))?;
    while let Some(now) = member.next_cycle()? {
        if !member.is_lockstep() {
            threads.collect(&mut motor).map_err(ProcessError::own)?;
        }
        let mut header = Header::at(now.as_nanos());
        while let Some(frame) = goals.receive()? {
            header = Header { valid_at_ns: now.as_nanos(), ..frame.head().header_for_derived() };
            header.pass(Hop::Commanded, member.now().as_nanos());
            let decided_at = frame.head().hop_time(Hop::Decided).unwrap_or(frame.head().valid_at_ns);
            motor.goals(Instant::from_nanos(decided_at), frame.entries());
        }
        if emergency_flag.is_raised() {
            motor.emergency_stop(now);
        } else if motor.is_stopped() {
            motor.end_emergency();
        }
        if let Some(order) = arming.as_ref().and_then(Arming::ordered) {
            motor.arm(now, order.acknowledged_locks);
        }
        motor.step(now);
        threads.send(&mut motor, now).map_err(ProcessError::own)?;
        if member.is_lockstep() {
            threads.wait(&mut motor, now, step_timeout).map_err(ProcessError::own)?;
        }
        // A failure of the middleware ends the loop, so that torque goes off.
        if let Err(failure) = publish(&motor, header, &member, &mut states) {
            failed = Some(failure);
            break;
        }
        reporter.update(&mut motor, now);
        health_publisher.keep(&motor, &threads, now);
        member.health().refused = motor.counts().refused;
        member.health().drops = goals.drops();
        member.health().undelivered = states.undelivered();
        member.end_cycle(Progress::More)?;
    }
    if !launch.lockstep {
        let (motor, threads) = (&mut motor, &mut threads);
        shutdown(motor, threads, period, &emergency_flag, |motor, now| {
            // Shared memory may be gone; the end continues without it.
            let _published = publish(motor, Header::at(now.as_nanos()), &member, &mut states);
            Ok(())
        })?;
        ending::laid_down(motor.unconfirmed(), launch)?;
    }
    tracing::debug!(stale = motor.counts().stale, "the motor stops");
    ending::leave((member, goals, states, health_publisher), launch);
    failed.map_or(Ok(()), Err)
}

/// Whether the answers of the mock buses are waited for as long as an overloaded machine may need: no servo is real, no
/// fault is injected, and the processes have no real-time priority. Then a missing answer has one cause only.
fn waits_for_mock_bus(member: &ProcessNode, launch: &Launch, robot: &Robot) -> bool {
    !launch.lockstep
        && launch.campaign.is_none()
        && robot.leo.mock_bus.faults.is_empty()
        && robot.motor.buses.iter().all(|bus| bus.device == Device::Mock)
        && member.lacks_priority()
}

/// Publishes the state of every joint.
fn publish(
    motor: &Motor,
    header: Header,
    member: &ProcessNode,
    states: &mut FramePublisher<JointStates>,
) -> Result<(), ProcessError> {
    let mut all = motor.states();
    let unread = JointState::unread(u32::MAX, JointMode::Limp, JointCause::NotStarted);
    let count = all.len();
    let stamp = |header: &mut Header| header.pass(Hop::Moved, member.now().as_nanos());
    let state = |_| require!(all.next(), "{count} joints").unwrap_or(unread);
    states.send(header, count, state, stamp)?;
    Ok(())
}

/// Runs the orderly end: the joints decelerate and hold, then torque goes off. If an emergency stop is active, torque
/// goes off at once.
pub(crate) fn shutdown(
    motor: &mut Motor,
    threads: &mut BusThreads,
    period: Duration,
    emergency_flag: &EmergencyFlag,
    mut tell: impl FnMut(&Motor, Instant) -> Result<(), ProcessError>,
) -> Result<(), ProcessError> {
    let mut now = clock::now();
    let until = now + END_WITHIN;
    motor.begin_shutdown(now + LET_GO_AFTER);
    // With any period, the last cycle comes after the time at which torque goes off.
    while now < until && (motor.letting_go().is_none() || motor.unconfirmed() > 0) {
        clock::sleep_until(now + period);
        now = clock::now();
        threads.collect(motor).map_err(ProcessError::own)?;
        if emergency_flag.is_raised() {
            motor.let_go(JointCause::Emergency);
        }
        motor.step(now);
        threads.send(motor, now).map_err(ProcessError::own)?;
        tell(motor, now)?;
    }
    match motor.unconfirmed() {
        0 => tracing::info!("every servo says that its torque is off"),
        silent => tracing::warn!("{silent} servos have not said that their torque is off"),
    }
    Ok(())
}
