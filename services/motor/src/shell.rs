use clock::{Duration, Instant};
use config::Robot;
use message::{Header, Hop, JointCause, JointGoals, JointMode, JointState, JointStates, Process};
use process::{Failure, Launch, Member, Progress};

use crate::Motor;
use crate::threads::Threads;

/// Drives the joints until the process is told to stop. It then leaves them as they are: their
/// servos hold until somebody drives them again.
///
/// # Errors
///
/// The configuration is refused, a bus cannot be opened, the domain cannot be joined, or the
/// middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Motor, &leo.buffers, &leo.motor.realtime)?;
    let mut goals = member.inlet::<JointGoals>(None)?;
    let mut states = member.outlet::<JointStates>(None, robot.motor.joints.len())?;
    let mut motor = Motor::new(&robot.motor, &leo.motor).map_err(Failure::own)?;
    let mut reporter = Reporter::new(robot);
    let period = leo.motor.rate_hz.period();
    let turn_within = leo.supervisor.turn_within_ms.duration();
    // In lockstep a slow machine must not look like a silent servo.
    let patience = if launch.lockstep { turn_within / 4 } else { 2 * period };
    // A device may still be starting. In lockstep the mock servo bus has to be there at every turn.
    let until = clock::now() + leo.supervisor.ready_within_ms.duration() / 2;
    let mut threads = Threads::start(&robot.motor.buses, &launch.domain, patience, until, !launch.lockstep)
        .map_err(Failure::own)?;
    member.begin(Some(period))?;
    while let Some(now) = member.next_cycle()? {
        if !member.is_lockstep() {
            threads.collect(&mut motor).map_err(Failure::own)?;
        }
        let mut header = Header::at(now.as_nanos());
        while let Some(frame) = goals.receive()? {
            header = Header { valid_at_ns: now.as_nanos(), ..frame.head().onwards() };
            header.pass(Hop::Commanded, member.now().as_nanos());
            let decided_at = frame.head().passed(Hop::Decided).unwrap_or(frame.head().valid_at_ns);
            motor.goals(Instant::from_nanos(decided_at), frame.entries());
        }
        motor.step(now);
        threads.send(&mut motor, now).map_err(Failure::own)?;
        if member.is_lockstep() {
            threads.wait(&mut motor, now, turn_within).map_err(Failure::own)?;
        }
        let mut all = motor.states();
        let unread = JointState::unread(u32::MAX, JointMode::Limp, JointCause::NotStarted);
        states.send(
            header,
            motor.states().len(),
            |_| all.next().unwrap_or(unread),
            |header| header.pass(Hop::Moved, member.now().as_nanos()),
        )?;
        reporter.look(&motor, now);
        member.health().refused = motor.counts().refused;
        member.health().drops = goals.drops();
        member.health().undelivered = states.undelivered();
        member.end_cycle(Progress::More)?;
    }
    tracing::debug!(skipped = threads.skipped(), stale = motor.counts().stale, "the motor stops");
    Ok(())
}

/// Tells people which joints are not as they should be, once each.
struct Reporter {
    names: Vec<String>,
    modes: Vec<Option<JointMode>>,
    all_follow: bool,
    /// Looking is spared most cycles: people are slow.
    look_at: Instant,
}

impl Reporter {
    const EVERY: Duration = Duration::from_millis(100);

    fn new(robot: &Robot) -> Self {
        let names: Vec<_> = robot.motor.joints.iter().map(|joint| joint.name.clone()).collect();
        let modes = vec![None; names.len()];
        Self { names, modes, all_follow: false, look_at: Instant::EPOCH }
    }

    fn look(&mut self, motor: &Motor, now: Instant) {
        if now < self.look_at {
            return;
        }
        self.look_at = now + Self::EVERY;
        let mut following = 0;
        for (index, state) in motor.states().enumerate() {
            following += usize::from(state.mode() == Some(JointMode::Following));
            let (Some(known), Some(name)) = (self.modes.get_mut(index), self.names.get(index)) else {
                continue;
            };
            if *known == state.mode() {
                continue;
            }
            *known = state.mode();
            if let Some(trouble) = motor.trouble(index) {
                tracing::warn!("{name}: {trouble}");
            } else if state.mode() == Some(JointMode::Quarantined) {
                let why = match state.cause() {
                    Some(JointCause::BusLost) => "its bus is lost",
                    _ => "its servo does not answer; is it powered, and on this bus with this id?",
                };
                tracing::warn!("{name} is quarantined: {why}");
            }
        }
        let all_follow = following == self.names.len();
        if all_follow && !self.all_follow {
            tracing::info!("all {following} joints follow");
        }
        self.all_follow = all_follow;
    }
}
