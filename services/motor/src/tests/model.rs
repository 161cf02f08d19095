//! Model checking of the real motor core with one joint on one bus.
//!
//! The transitions are those of the real code: [`Motor`], its joint and its bus planner drive the mock servo, cycle
//! by cycle. The checker (stateright) explores every action from every state, breadth first and exhaustively. In
//! every state it also tries an orderly end and an emergency stop, and runs them for a bounded number of cycles.
//!
//! # Abstraction
//!
//! - Two states are equal if they agree in these: the four state machines with their inner steps, the orders to the
//!   whole body, the fault of the line, and whether there was an order or a reset. Of the servo these count: torque,
//!   watchdog (while torque is on), alert, and position (within, beyond, or far beyond the limits). The first state
//!   reached represents its class. Counters, times, exact positions and most causes are ignored.
//! - Time advances by 4 ms, 100 ms and 600 ms of cycles, and by 300 ms in which the process stalls.
//! - Configured times are short. Joints are armed only by orders. Alerts occur only with stop category 0.
//!
//! # Not proven
//!
//! - Behaviour that depends on exact times, or on counters that differ within one class of states. Property tests and
//!   the fault campaign cover it.
//! - Interactions of several joints or buses, because there is only one joint. The state table gives a joint the
//!   orders that others cause.
//! - Single lost or corrupt packets: here a servo is mute, or its line is lost, for a while. The state table has
//!   single packets, deaf servos, other programs, and joints far beyond their limits.
//! - Events during an orderly end. Events during an emergency stop are included.
//! - A servo that restarts in the cycle in which it is told to stay where it is. The job switches its torque on
//!   without an order, with its watchdog armed, and the servo holds its position.
//! - The threads, the supervisor and the processes around the core.
//! - Behaviour of a real servo that the mock does not have.

use std::hash::{Hash, Hasher};

use super::one_joint::{
    ExchangeFault, GOAL_RAD, ONE_JOINT, SHORT, exchange, item, one_servo, push_to, sends_goals,
};
use super::state_table::{check_published, field, joint_key};
use super::*;

use message::{JointArming, JointMotion, JointPower};
use servo::mock::HardwareError;
use servo::table::{BUS_WATCHDOG, TORQUE_ENABLE};
use stateright::{Checker, HasDiscoveries, Model as Checked, Property};

/// Cycles within which every end completes if the servo answers. A category 1 stop takes 750 ms.
const ENDS_WITHIN: u32 = 220;
/// Cycles within which a returning servo confirms torque off. A rebooting servo does not respond for 400 ms.
const CONFIRMED_WITHIN: u32 = 130;
/// Time after which an orderly end switches torque off even if the joint moves.
const END: Duration = Duration::from_millis(48);
/// A restart of the servo is detected after some readings.
const KNOWN_AFTER: Duration = Duration::from_millis(100);

/// A deliberate error in the motor process, which the checker must find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mutation {
    None,
    /// The release of an emergency stop arms the joints.
    ReleaseArms,
    /// Torque comes on without the servo's bus watchdog.
    NoWatchdog,
    /// Servos keep their torque although they are told to switch it off.
    KeepsTorque,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Action {
    /// A number of cycles.
    Cycles(u32),
    StandsStill,
    /// The commander starts or stops.
    Commander(bool),
    /// The fault from now on.
    Line(ExchangeFault),
    Restart,
    Alert(HardwareError),
    PushedTo(f64),
    Arm {
        acknowledges: bool,
    },
    Raise,
    Release,
}

/// State of the motor process, the bus and the servo.
#[derive(Clone)]
struct World {
    motor: Motor,
    line: Line,
    now: Instant,
    has_commander: bool,
    wrong: ExchangeFault,
    arming: JointArming,
    /// End of the validity of an order that has not armed anything yet.
    order_until: Option<Instant>,
    /// Set after a reset: from then on, when the reset has been detected, nothing may start before an operator's
    /// order.
    reset_at: Option<Instant>,
    /// A violated property, if there is one.
    broken: Option<String>,
    key: String,
}

impl PartialEq for World {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Hash for World {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.key.hash(state);
    }
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.key, self.broken)
    }
}

impl World {
    fn new(category: u8, found: bool) -> Self {
        let robot = config::motor::parse(ONE_JOINT, "motor.toml".as_ref()).unwrap();
        let settings = SHORT.replace("stop_category = 0", &format!("stop_category = {category}"));
        let settings = config::parse(&settings, "leo.toml".as_ref()).unwrap();
        let mut line = one_servo();
        if found {
            line.servos[0].write(TORQUE_ENABLE.address, &[1]).unwrap();
        }
        let mut world = Self {
            motor: Motor::new(&robot, &settings).unwrap(),
            line,
            now: Instant::from_nanos(1_000_000_000),
            has_commander: true,
            wrong: ExchangeFault::Nothing,
            arming: JointArming::Disarmed,
            order_until: None,
            reset_at: None,
            broken: None,
            key: String::new(),
        };
        world.remember();
        world
    }

    fn state(&self) -> JointState {
        self.motor.states().next().unwrap()
    }

    fn has_torque(&self) -> bool {
        item(&self.line, TORQUE_ENABLE) == 1
    }

    /// Whether the servo receives instructions and its answers arrive.
    fn answers(&self) -> bool {
        self.wrong == ExchangeFault::Nothing && self.line.servos[0].is_listening()
    }

    fn act(&mut self, action: Action, mutation: Mutation) {
        let mut cycles = 1;
        match action {
            Action::Cycles(count) => cycles = count,
            Action::StandsStill => {
                // Nothing can be detected meanwhile.
                let still = Duration::from_millis(300);
                self.now += still;
                self.reset_at = self.reset_at.map(|at| at + still);
            }
            Action::Commander(there) => self.has_commander = there,
            Action::Line(wrong) => {
                if self.wrong == ExchangeFault::LineLost || wrong == ExchangeFault::LineLost {
                    self.reset(KNOWN_AFTER);
                }
                self.wrong = wrong;
            }
            Action::Restart => {
                self.reset(KNOWN_AFTER);
                self.line.servos[0].restart();
            }
            Action::Alert(error) => self.line.servos[0].fail(error),
            Action::PushedTo(to_rad) => push_to(&mut self.line, to_rad),
            Action::Arm { acknowledges } => self.arm(acknowledges),
            Action::Raise => self.motor.emergency_stop(self.now),
            Action::Release => {
                self.reset(Duration::ZERO);
                self.motor.end_emergency();
                if mutation == Mutation::ReleaseArms {
                    self.motor.arm(self.now, None);
                }
            }
        }
        for _ in 0..cycles {
            if self.broken.is_none() {
                self.cycle(mutation);
            }
        }
        self.remember();
    }

    /// Records a reset: nothing may start before an operator's order. An order that has not switched anything on
    /// stays valid.
    fn reset(&mut self, known_after: Duration) {
        if self.order_until.is_none() || self.state().machines().unwrap().power == JointPower::On {
            (self.order_until, self.reset_at) = (None, Some(self.now + known_after));
        }
    }

    fn is_reset(&self) -> bool {
        self.reset_at.is_some_and(|at| self.now > at)
    }

    fn arm(&mut self, acknowledges: bool) {
        let locks = acknowledges.then(|| self.motor.counts().locks);
        self.motor.arm(self.now, locks);
        // An order during the emergency stop does not release it.
        if !self.motor.is_stopped() {
            (self.order_until, self.reset_at) = (Some(self.now + Duration::from_secs(10)), None);
        }
    }

    fn cycle(&mut self, mutation: Mutation) {
        self.now += PERIOD;
        let (now, had_torque) = (self.now, self.has_torque());
        if self.has_commander {
            self.motor.goals(now, &[goal(0, GOAL_RAD, now)]);
        }
        self.motor.step(now);
        self.motor.take_notices(|_, _| ());
        self.check();
        let (mut request, mut replies) = (Request::default(), Replies::default());
        self.motor.request(0, now, &mut request);
        let (is_sent, before) = (sends_goals(&request), self.state().machines().unwrap());
        // Torque off and on again: a servo that restarted undetected holds its position.
        let is_stay = request.parts().any(|(part, bytes)| {
            let says = |words: &[u8]| bytes.windows(words.len()).any(|window| window == words);
            part.kind == PartKind::Job && says(&[0x83, 64, 0, 1, 0, 1, 0]) && says(&[3, 64, 0, 1])
        });
        exchange(&mut self.line, now, self.wrong, &request, &mut replies);
        if mutation == Mutation::NoWatchdog && self.has_torque() && !had_torque {
            self.line.servos[0].write(BUS_WATCHDOG.address, &[0]).unwrap();
        }
        if mutation == Mutation::KeepsTorque && self.motor.letting_go().is_some() && had_torque {
            self.line.servos[0].write(TORQUE_ENABLE.address, &[1]).unwrap();
        }
        self.motor.replies(0, now, &replies);
        self.check();
        if is_sent && (before.motion == JointMotion::Idle || before.arming != JointArming::Armed) {
            self.fail("(a) a goal was sent without the guard");
        }
        // Nothing disables this servo's watchdog. A tripped watchdog makes the servo ignore goals.
        if is_sent && self.has_torque() && item(&self.line, BUS_WATCHDOG) == 0 {
            self.fail("(a) a goal was sent to a servo without a watchdog");
        }
        if self.has_torque() && !had_torque {
            if is_stay && item(&self.line, BUS_WATCHDOG) != 10 {
                self.fail("(a) a servo was told to stay, and has torque without a watchdog");
            } else if !is_stay && before.arming != JointArming::Armed {
                self.fail("(b) torque came on without arming");
            } else if !is_stay && self.is_reset() {
                self.fail("(c) torque came on after a reset");
            }
        }
    }

    /// Checks the invariants of every step.
    fn check(&mut self) {
        let (state, machines) = (self.state(), self.state().machines().unwrap());
        if let Err(error) = check_published(&state) {
            self.fail(&format!("(a) {error}"));
        }
        if self.motor.counts().violations > 0 {
            self.fail("(a) a motion was not allowed, and was stopped");
        }
        let is_armed = machines.arming == JointArming::Armed;
        let was_armed = self.arming == JointArming::Armed;
        if is_armed && !was_armed {
            let has_order = self.order_until.is_some_and(|until| self.now <= until);
            if self.is_reset() {
                self.fail("(c) the joint was armed by a reset");
            } else if !has_order {
                self.fail("(b) the joint was armed without an order");
            }
        }
        // An order arms a joint once, and again if it had to wait for others.
        let waited = matches!(machines.arming_cause, JointCause::GroupStopped | JointCause::BodyStopped);
        if was_armed && !is_armed && !waited {
            self.order_until = None;
        }
        self.arming = machines.arming;
        // A joint that is decelerating may continue to.
        let starts =
            matches!(machines.motion, JointMotion::Align | JointMotion::SoftStart | JointMotion::Track);
        if self.is_reset() && self.answers() && starts {
            self.fail("(c) the joint moves after a reset");
        }
    }

    fn fail(&mut self, why: &str) {
        self.broken.get_or_insert_with(|| why.to_owned());
    }

    /// Computes the class of this state.
    fn remember(&mut self) {
        let text = format!("{:?}", self.motor);
        let servo = &self.line.servos[0];
        let torque = self.has_torque();
        let watchdog = torque.then(|| item(&self.line, BUS_WATCHDOG));
        let place = [0.1, 1.0].map(|bound_rad| servo.position_rad().abs() - 1.0 > bound_rad);
        let body = ["let_go_at", "letting_go", "stopping"].map(|name| field(&text, name) != "None");
        let has_order = self.order_until.is_some_and(|until| self.now <= until);
        // Only what makes a difference in this state counts; for example, a commander matters only to a joint that is
        // armed or has torque.
        let (power, arming) = (field(&text, "power"), field(&text, "arming"));
        let has_power = ["Found", "On", "Rising"].iter().any(|kind| power.starts_with(kind));
        let has_commander = self.has_commander || !(has_power || arming.starts_with("Armed"));
        let has_alert = servo.has_alert() && !arming.contains("Alert");
        let rest = (torque, watchdog, has_alert, place, body, has_order, self.reset_at.is_some());
        let given = (has_commander, self.wrong, &self.broken);
        self.key = format!("{} {rest:?} {given:?}", joint_key(&text));
    }

    /// Whether an end completes: torque is off and confirmed. While the servo does not answer, it must be
    /// unconfirmed.
    fn comes_to_an_end(&self, end: impl Fn(&mut Self), mutation: Mutation) -> bool {
        let mut world = self.clone();
        end(&mut world);
        let has_ended = |world: &Self| world.motor.letting_go().is_some() && world.motor.unconfirmed() == 0;
        let run = |world: &mut Self, max: u32| {
            let mut since = 0;
            for _ in 0..max {
                world.cycle(mutation);
                since += u32::from(world.motor.letting_go().is_some());
                // A servo that does not answer after some cycles does not answer later.
                if has_ended(world)
                    || world.broken.is_some()
                    || (since > 6 && world.wrong != ExchangeFault::Nothing)
                {
                    return;
                }
            }
        };
        run(&mut world, ENDS_WITHIN);
        if !has_ended(&world) && !world.answers() && world.motor.letting_go().is_some() {
            world.wrong = ExchangeFault::Nothing;
            run(&mut world, CONFIRMED_WITHIN);
        }
        // The result must be stable.
        run(&mut world, 1);
        has_ended(&world) && !world.has_torque() && world.broken.is_none()
    }
}

/// The motor process with an emergency stop of a given category.
struct Process {
    category: u8,
    mutation: Mutation,
}

impl Checked for Process {
    type State = World;
    type Action = Action;

    fn init_states(&self) -> Vec<World> {
        [false, true].map(|found| World::new(self.category, found)).to_vec()
    }

    fn actions(&self, world: &World, actions: &mut Vec<Action>) {
        if world.broken.is_some() {
            return;
        }
        actions.extend([1, 25, 150].map(Action::Cycles));
        actions.extend([Action::StandsStill, Action::Restart]);
        actions.push(Action::Commander(!world.has_commander));
        let faults = [ExchangeFault::Nothing, ExchangeFault::Mute, ExchangeFault::LineLost];
        actions.extend(faults.into_iter().filter(|wrong| *wrong != world.wrong).map(Action::Line));
        if self.category == 0 {
            actions.extend([HardwareError::InputVoltage, HardwareError::Overload].map(Action::Alert));
        }
        actions.extend([0.2, 1.4].map(Action::PushedTo));
        actions.extend([false, true].map(|acknowledges| Action::Arm { acknowledges }));
        actions.push(if world.motor.is_stopped() { Action::Release } else { Action::Raise });
    }

    fn next_state(&self, world: &World, action: Action) -> Option<World> {
        let mut next = world.clone();
        next.act(action, self.mutation);
        Some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        let mut properties = vec![
            Property::always(SAFE, |_, world: &World| world.broken.is_none()),
            Property::always(ORDERLY_END, |process: &Self, world: &World| {
                let begin_shutdown = |world: &mut World| world.motor.begin_shutdown(world.now + END);
                world.comes_to_an_end(begin_shutdown, process.mutation)
            }),
            // Reachability.
            Property::sometimes("the joint follows", |_, world: &World| {
                world.state().mode() == Some(JointMode::Following)
            }),
            Property::sometimes("the joint goes back within its limits", |_, world: &World| {
                world.state().mode() == Some(JointMode::Aligning)
            }),
        ];
        if self.category == 0 {
            properties.push(Property::sometimes("the joint is lowered", |_, world: &World| {
                world.state().mode() == Some(JointMode::Lowering)
            }));
        }
        // A category 2 stop keeps torque on.
        if self.category < 2 {
            properties.push(Property::always(EMERGENCY_END, |process: &Self, world: &World| {
                let stop = |world: &mut World| world.motor.emergency_stop(world.now);
                world.comes_to_an_end(stop, process.mutation)
            }));
        }
        properties
    }
}

const SAFE: &str = "nothing moves without the guard, without an order, or by a reset";
const ORDERLY_END: &str = "an orderly end comes to an end";
const EMERGENCY_END: &str = "an emergency stop comes to an end";

/// Explores all states. Returns the violations, with the actions that lead there.
fn explore(category: u8, mutation: Mutation) -> Vec<String> {
    let checker =
        Process { category, mutation }.checker().finish_when(HasDiscoveries::AnyFailures).spawn_bfs().join();
    println!(
        "category {category}, {mutation:?}: {} states, {} steps, depth {}",
        checker.unique_state_count(),
        checker.state_count(),
        checker.max_depth()
    );
    let mut wrong = Vec::new();
    for property in checker.model().properties() {
        let is_always = [SAFE, ORDERLY_END, EMERGENCY_END].contains(&property.name);
        match checker.discovery(property.name) {
            Some(path) if is_always => {
                let last = path.last_state();
                wrong.push(format!("not `{}`: {last:?} by {:?}", property.name, path.clone().into_actions()));
            }
            None if !is_always => wrong.push(format!("never `{}`", property.name)),
            Some(_) | None => {}
        }
    }
    wrong
}

#[test]
fn no_state_moves_a_joint_without_the_watchdog_and_every_ending_terminates() {
    assert_eq!(explore(0, Mutation::None), [] as [&str; 0]);
}

#[test]
fn with_a_controlled_stop_no_state_moves_without_the_watchdog() {
    for category in [1, 2] {
        assert_eq!(explore(category, Mutation::None), [] as [&str; 0], "stop category {category}");
    }
}

#[test]
fn the_model_checker_finds_a_seeded_error() {
    let finds = |mutation, words: &str| {
        let wrong = explore(0, mutation);
        assert!(wrong.iter().any(|wrong| wrong.contains(words)), "{mutation:?}: {wrong:?}");
    };
    finds(Mutation::ReleaseArms, "(c) the joint was armed by a reset");
    finds(Mutation::NoWatchdog, "(a) a goal was sent to a servo without a watchdog");
    finds(Mutation::KeepsTorque, ORDERLY_END);
}

/// The state after these actions.
fn after(category: u8, actions: &[Action]) -> World {
    let mut world = World::new(category, false);
    for action in actions {
        world.act(*action, Mutation::None);
        assert_eq!(world.broken, None, "{action:?}");
    }
    world
}

/// An arming order.
const ARM: Action = Action::Arm { acknowledges: false };

#[test]
fn a_servo_that_restarts_on_its_way_back_has_a_watchdog() {
    use Action::{Cycles, PushedTo, Restart, StandsStill};
    let world = after(0, &[Cycles(25), ARM, PushedTo(2.6), StandsStill, Restart]);
    let begin_shutdown = |world: &mut World| world.motor.begin_shutdown(world.now + END);
    assert!(world.comes_to_an_end(begin_shutdown, Mutation::None));
}

#[test]
fn a_restarted_servo_that_was_found_with_torque_waits_for_an_order() {
    use Action::{Commander, Cycles, Line, PushedTo, Raise, Release, Restart, StandsStill};
    let (mute, well) = (Line(ExchangeFault::Mute), Line(ExchangeFault::Nothing));
    let stopped = [Cycles(25), ARM, Cycles(1), PushedTo(1.4), mute, Raise, Release, well, Cycles(25)];
    let restarted = [Commander(false), mute, ARM, Restart, PushedTo(0.2), well, PushedTo(1.4)];
    let back = [Commander(true), StandsStill, PushedTo(0.2), Cycles(25), Cycles(25)];
    let world = after(1, &[&stopped[..], &restarted, &back].concat());
    assert_ne!(world.arming, JointArming::Armed);
}

#[test]
fn an_order_to_an_armed_joint_is_void_after_a_failure() {
    use Action::{Alert, Commander, Cycles, Line, PushedTo, Restart, StandsStill};
    let (mute, well, lost) =
        (Line(ExchangeFault::Mute), Line(ExchangeFault::Nothing), Line(ExchangeFault::LineLost));
    let acknowledged = Action::Arm { acknowledges: true };
    let held = [Cycles(25), PushedTo(1.4), ARM, Cycles(25), acknowledged, Commander(false), PushedTo(0.2)];
    let failed = [Restart, mute, Alert(HardwareError::InputVoltage), Restart, well, Restart, mute, ARM];
    let back = [lost, Commander(true), well, StandsStill, Cycles(25), Cycles(25)];
    let world = after(0, &[&held[..], &failed, &back].concat());
    assert_ne!(world.arming, JointArming::Armed);
}
