use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::motor::{Bus, Device};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, TryRecvError, bounded};
use message::Histogram;
use process::Lookout;
use serial::{OpenError, Tty};

use crate::{Line, Master, Motor, Replies, Request};

/// A bus that is given nothing to do for this long looks by itself whether all shall stop.
const UNLED: Duration = Duration::from_millis(20);

/// One thread per bus, each with its line. What a thread carries goes to and fro in the same
/// memory: nothing is allocated in a cycle.
#[derive(Debug)]
pub(crate) struct Threads {
    ends: Vec<End>,
}

#[derive(Debug)]
struct End {
    name: String,
    to: Option<Sender<Box<Exchange>>>,
    from: Receiver<Box<Exchange>>,
    /// Requests that had to be left out because the bus was still busy.
    skipped: u64,
    /// How long the requests took.
    took: Histogram,
    /// Here while the bus is idle, with the thread while it is busy.
    exchange: Option<Box<Exchange>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Exchange {
    request: Request,
    replies: Replies,
    /// When the request was taken up, and when its replies were complete.
    begun_at: Instant,
    done_at: Instant,
}

/// Why the threads of the buses cannot go on.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ThreadError {
    #[error("bus `{bus}`: {source}")]
    Open { bus: String, source: OpenError },
    #[error("no thread for bus `{bus}`: {source}")]
    Spawn { bus: String, source: std::io::Error },
    #[error("bus `{bus}` has not answered within {} s: its device hangs", within.as_secs())]
    Hangs { bus: String, within: Duration },
    #[error("the thread of bus `{bus}` ended")]
    Ended { bus: String },
}

impl Threads {
    /// Opens the line of every bus, those of the mock servo bus in `folder`, and starts its
    /// thread. Lines may appear until `until`; those of the mock servo bus, where it `may_be_gone`,
    /// at any time: it is a process of its own that may be starting anew just now. A servo may be
    /// silent for `patience` as in [`Master::new`]. Where the cycle gives a bus nothing to do and
    /// the emergency stop is raised, the bus switches every torque off by itself.
    pub(crate) fn start(
        buses: &[Bus],
        folder: &Path,
        patience: (Duration, Duration),
        until: Instant,
        may_be_gone: bool,
        lookout: &Lookout,
    ) -> Result<Self, ThreadError> {
        let ends = buses
            .iter()
            .map(|bus| {
                let (path, is_mock) = match &bus.device {
                    Device::Mock => (folder.join(format!("bus-{}", bus.name)), true),
                    Device::Tty(path) => (path.clone(), false),
                };
                let tty = match Tty::open(&path, bus.baud) {
                    Ok(tty) => Some(tty),
                    Err(_) if is_mock && may_be_gone => None,
                    Err(_) => Some(
                        open_until(&path, bus.baud, until)
                            .map_err(|source| ThreadError::Open { bus: bus.name.clone(), source })?,
                    ),
                };
                End::start(bus, path, tty, patience, lookout.clone())
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { ends })
    }

    /// By bus, the requests left out because it was still busy with the one before, and how long
    /// those took that were not.
    pub(crate) fn fared(&self) -> impl Iterator<Item = (u64, &Histogram)> {
        self.ends.iter().map(|end| (end.skipped, &end.took))
    }

    /// Hands every idle bus its request. A bus that is still busy goes without one this time.
    pub(crate) fn send(&mut self, motor: &mut Motor, now: Instant) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
            let Some(mut exchange) = end.exchange.take() else {
                end.skipped += 1;
                continue;
            };
            motor.request(bus, now, &mut exchange.request);
            let ended = || ThreadError::Ended { bus: end.name.clone() };
            end.to.as_ref().ok_or_else(ended)?.send(exchange).map_err(|_| ended())?;
        }
        Ok(())
    }

    /// Takes the replies that are there.
    pub(crate) fn collect(&mut self, motor: &mut Motor) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
            match end.from.try_recv() {
                Ok(exchange) => {
                    end.took.record(clock::nanos(exchange.done_at.since(exchange.begun_at)));
                    motor.replies(bus, exchange.done_at, &exchange.replies);
                    end.exchange = Some(exchange);
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(ThreadError::Ended { bus: end.name.clone() }),
            }
        }
        Ok(())
    }

    /// Lockstep: waits for the replies of every bus, which are of the instant `now` whenever they
    /// come.
    pub(crate) fn wait(
        &mut self,
        motor: &mut Motor,
        now: Instant,
        within: Duration,
    ) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
            let name = || end.name.clone();
            let mut exchange = end.from.recv_timeout(within).map_err(|error| match error {
                RecvTimeoutError::Timeout => ThreadError::Hangs { bus: name(), within },
                RecvTimeoutError::Disconnected => ThreadError::Ended { bus: name() },
            })?;
            exchange.replies.stamp(now);
            motor.replies(bus, now, &exchange.replies);
            end.exchange = Some(exchange);
        }
        Ok(())
    }
}

impl End {
    fn start(
        bus: &Bus,
        path: PathBuf,
        tty: Option<Tty>,
        patience: (Duration, Duration),
        lookout: Lookout,
    ) -> Result<Self, ThreadError> {
        let name = bus.name.clone();
        let (to, inbox) = bounded::<Box<Exchange>>(1);
        let (outbox, from) = bounded(1);
        let mut line = Line::new(tty, path, bus.baud);
        let mut master = Master::new(bus.baud, patience);
        let thread = std::thread::Builder::new()
            .name(format!("bus {name}"))
            .spawn(move || {
                loop {
                    match inbox.recv_timeout(UNLED) {
                        Ok(mut job) => {
                            let Exchange { request, replies, begun_at, done_at } = job.as_mut();
                            *begun_at = clock::now();
                            master.exchange(&mut line, request, replies);
                            *done_at = clock::now();
                            if outbox.send(job).is_err() {
                                break;
                            }
                        }
                        // The cycle itself may hang: an emergency stop must not wait for it.
                        Err(RecvTimeoutError::Timeout) if lookout.is_raised() => master.cut(&mut line),
                        Err(RecvTimeoutError::Timeout) => {}
                        Err(RecvTimeoutError::Disconnected) => break,
                    }
                }
            })
            .map_err(|source| ThreadError::Spawn { bus: name.clone(), source })?;
        Ok(Self {
            name,
            to: Some(to),
            from,
            skipped: 0,
            took: Histogram::default(),
            exchange: Some(Box::default()),
            thread: Some(thread),
        })
    }
}

impl Drop for End {
    /// Ends the thread: it finishes the request that it carries, and finds nobody behind it.
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ended = thread.join();
        }
    }
}

fn open_until(path: &Path, baud: u32, until: Instant) -> Result<Tty, OpenError> {
    loop {
        match Tty::open(path, baud) {
            Ok(tty) => return Ok(tty),
            Err(error) if clock::now() >= until => return Err(error),
            Err(_) => clock::sleep_until(clock::now() + Duration::from_millis(10)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use config::Robot;
    use message::{JointCause, JointGoal, JointMode, JointState};
    use mock_bus_process::Ptys;
    use servo::table::{BUS_WATCHDOG, Item, MOVING, TORQUE_ENABLE};
    use servo::{Id, Instruction, Parser, Status};

    const PERIOD: Duration = Duration::from_millis(4);
    const LONG: Duration = Duration::from_secs(20);

    /// The whole robot: 65 joints on five buses.
    struct Rig {
        robot: Robot,
        folder: tempfile::TempDir,
        ptys: Option<Ptys>,
        threads: Threads,
        motor: Motor,
        now: Instant,
        lockstep: bool,
        /// Where every joint shall be, as a share of its highest position.
        share: f64,
    }

    impl Rig {
        fn new(lockstep: bool) -> Self {
            let robot = Robot::load(None).unwrap();
            let folder = tempfile::tempdir().unwrap();
            let ptys = Ptys::open(&robot.motor, folder.path(), lockstep).unwrap();
            let patience = if lockstep { (LONG, LONG) } else { (PERIOD / 4, 2 * PERIOD) };
            let until = clock::now() + LONG;
            let threads = Threads::start(
                &robot.motor.buses,
                folder.path(),
                patience,
                until,
                false,
                &Lookout::default(),
            )
            .unwrap();
            let motor = Motor::new(&robot.motor, &robot.leo.motor).unwrap();
            let now = if lockstep { Instant::EPOCH } else { clock::now() };
            Self { robot, folder, ptys: Some(ptys), threads, motor, now, lockstep, share: 1.0 / 3.0 }
        }

        /// A cycle in which every joint shall go a share of the way to its upper limit.
        fn cycle(&mut self) {
            self.now += PERIOD;
            if self.lockstep {
                self.ptys.as_ref().unwrap().advance(self.now);
            } else {
                clock::sleep_until(self.now);
                self.now = clock::now();
                self.threads.collect(&mut self.motor).unwrap();
            }
            let goals: Vec<_> = (0..)
                .zip(&self.robot.motor.joints)
                .map(|(joint, settings)| JointGoal {
                    joint,
                    reserved: 0,
                    goal_position_rad: settings.max_rad * self.share,
                    arrive_at_ns: 0,
                })
                .collect();
            self.motor.goals(self.now, &goals);
            self.motor.step(self.now);
            self.threads.send(&mut self.motor, self.now).unwrap();
            if self.lockstep {
                self.threads.wait(&mut self.motor, self.now, LONG).unwrap();
            }
        }

        /// Cycles until all joints are as they should be.
        fn until(&mut self, what: &str, is_so: impl Fn(&JointState) -> bool) {
            let give_up = clock::now() + LONG;
            while !self.motor.states().all(|state| is_so(&state)) {
                self.cycle();
                assert!(clock::now() < give_up, "not {what}: {:?}", self.motor.states().collect::<Vec<_>>());
            }
        }

        fn is_there(&self) -> impl Fn(&JointState) -> bool + use<> {
            let goals: Vec<_> = self.robot.motor.joints.iter().map(|joint| joint.max_rad / 3.0).collect();
            move |state| {
                let goal = goals[usize::try_from(state.joint).unwrap()];
                state.present_position_rad().is_some_and(|present| (present - goal).abs() < 0.003)
            }
        }
    }

    fn follows(state: &JointState) -> bool {
        state.mode() == Some(JointMode::Following)
    }

    #[test]
    fn in_lockstep_65_joints_do_the_same_to_the_last_bit_in_every_run() {
        let run = || {
            let mut rig = Rig::new(true);
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
    fn in_wall_time_joints_come_up_arrive_and_come_back_when_their_buses_were_lost() {
        let mut rig = Rig::new(false);
        rig.until("following", follows);
        let is_there = rig.is_there();
        rig.until("there", is_there);
        rig.ptys = None;
        rig.until("lost", |state| state.cause() == Some(JointCause::BusLost));
        rig.ptys = Some(Ptys::open(&rig.robot.motor, rig.folder.path(), false).unwrap());
        rig.until("following again", follows);
    }

    /// What an item of a servo says, asked by another master than the one that is gone.
    fn item(tty: &Tty, id: u8, item: Item) -> i64 {
        let question = Instruction::Read { address: item.address, length: item.length };
        let mut bytes = [0; 64];
        let length = question.encode(Id::new(id).unwrap().into(), &mut bytes).unwrap();
        tty.write(&bytes[..length], clock::now() + LONG).unwrap();
        let mut parser = Parser::new();
        loop {
            let count = tty.read(&mut bytes, clock::now() + LONG).unwrap();
            parser.push(&bytes[..count]);
            if let Some(status) = parser.next_frame().and_then(|frame| Status::parse(&frame)) {
                let mut value = [0; 8];
                value[..status.params.len()].copy_from_slice(status.params);
                return i64::from_le_bytes(value);
            }
        }
    }

    #[test]
    fn servos_whose_commander_died_in_motion_stop_by_themselves() {
        let mut rig = Rig::new(false);
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
        // The commander is gone in the middle of it, without a word.
        rig.threads = Threads { ends: Vec::new() };
        let silent_since = clock::now();
        // Any word on the bus would count as life: it is left alone for as long as the watchdog waits,
        // and for what a servo needs to stop.
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
    fn a_mock_servo_bus_may_come_after_the_motor() {
        let mut rig = Rig::new(false);
        rig.ptys = None;
        let buses = &rig.robot.motor.buses;
        let (patience, calm) = ((PERIOD / 4, 2 * PERIOD), Lookout::default());
        rig.threads =
            Threads::start(buses, rig.folder.path(), patience, Instant::EPOCH, true, &calm).unwrap();
        rig.until("lost", |state| state.cause() == Some(JointCause::BusLost));
        rig.ptys = Some(Ptys::open(&rig.robot.motor, rig.folder.path(), false).unwrap());
        rig.until("following", follows);
    }

    #[test]
    fn a_device_that_is_not_there_is_named() {
        let robot = Robot::load(None).unwrap();
        let started = Threads::start(
            &robot.motor.buses,
            Path::new("/nowhere"),
            (PERIOD, PERIOD),
            Instant::EPOCH,
            false,
            &Lookout::default(),
        );
        let said = started.unwrap_err().to_string();
        assert!(said.starts_with("bus `face_left`: cannot open /nowhere/bus-face_left: "), "{said}");
    }
}
