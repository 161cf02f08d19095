//! Every state of a joint's four state machines is exposed to every event.
//!
//! The real [`Joint`] and the real bus planner drive the mock servo. A breadth-first search applies every event to
//! every state that it reaches. After each cycle it checks that no motion occurs without permission. The search
//! starts with a servo from the factory, and with servos that an earlier process left with torque on.
//!
//! Two states are equal if their state machines, the orders to the body and the servo agree, as far as that matters.
//! Numbers, times and most causes are ignored. The first state reached represents its class.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::slice::from_mut;

use super::one_joint::{
    ExchangeFault, GOAL_RAD, ONE_JOINT, SHORT, exchange, item, one_servo, push_to, sends_goals,
};
use super::*;

use config::leo::AlertReaction;
use message::{JointArming, JointLink, JointMotion, JointPower};
use servo::mock::HardwareError;
use servo::table::{BUS_WATCHDOG, TORQUE_ENABLE};

use crate::bus::{Bus, Purpose};

use crate::joint::{BodyState, Joint, Policy};

/// Cycles after which a silent servo is quarantined if it is the only one on the bus.
const SILENT: u32 = 14;
/// Period of the condition reads, and a little more.
const LOOKED: Duration = Duration::from_millis(560);

/// Value of the first field of this name in a `Debug` text.
pub(super) fn field<'a>(text: &'a str, name: &str) -> &'a str {
    let start = text.find(&format!(" {name}: ")).unwrap_or_else(|| panic!("no field `{name}` in {text}"));
    let value = &text[start + name.len() + 3..];
    let mut depth = 0;
    for (at, byte) in value.bytes().enumerate() {
        match byte {
            b'(' | b'{' | b'[' => depth += 1,
            b')' | b'}' | b']' | b',' if depth == 0 => return value[..at].trim_end(),
            b')' | b'}' | b']' => depth -= 1,
            _ => {}
        }
    }
    value
}

/// The text without its numbers.
fn normalised(text: &str) -> String {
    text.replace(|letter: char| letter.is_ascii_digit() || matches!(letter, '.' | '-'), "")
}

/// Class of the state machines of a joint, from its `Debug` text.
pub(super) fn joint_key(text: &str) -> String {
    let fields = ["link", "power", "arming", "motion", "cut_at", "reboot_at"].map(|name| field(text, name));
    let key = normalised(&fields.join(" "));
    // Only causes after which a joint behaves differently count.
    let mut words: Vec<&str> = key.split(' ').collect();
    for at in 1..words.len() {
        let is_special =
            ["Alert", "Blocked", "BeyondLimits"].iter().any(|cause| words[at].starts_with(cause));
        if matches!(words[at - 1], "cause:" | "after:") && !is_special {
            words[at] = "any";
        }
    }
    words.join(" ")
}

/// Checks that the published state is consistent, and that no motion occurs in a mode without motion.
pub(super) fn check_published(state: &JointState) -> Result<(), String> {
    let (mode, machines) = (state.mode().unwrap(), state.machines().unwrap());
    let (power, motion) = (machines.power, machines.motion);
    let is_still = matches!(motion, JointMotion::Idle | JointMotion::Hold);
    let agrees = match mode {
        JointMode::Limp => {
            // A servo of another model is not read.
            motion == JointMotion::Idle
                && (power == JointPower::Off || machines.arming == JointArming::Locked)
        }
        JointMode::Starting | JointMode::Quarantined => {
            is_still || mode == JointMode::Starting && motion == JointMotion::Decelerate
        }
        JointMode::Holding => is_still && matches!(power, JointPower::On | JointPower::Found),
        JointMode::Following => matches!(motion, JointMotion::SoftStart | JointMotion::Track),
        JointMode::Decelerating => motion == JointMotion::Decelerate || power == JointPower::Found,
        JointMode::Releasing => power == JointPower::SwitchingOff && motion == JointMotion::Idle,
        JointMode::Aligning => motion == JointMotion::Align,
        JointMode::Lowering => motion == JointMotion::Lower,
    };
    let is_guarded = machines.link == JointLink::Answering
        && power == JointPower::On
        && machines.arming == JointArming::Armed;
    if motion != JointMotion::Idle && !is_guarded {
        return Err(format!("moves without the guard: {machines:?}"));
    }
    if agrees { Ok(()) } else { Err(format!("{mode:?} with {machines:?}")) }
}

/// Orders to the whole body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ordered {
    /// Commands arrive.
    Live,
    /// Commands have stopped, or have been absent for long.
    Gone,
    Limp,
    /// Another joint failed, or another bus is lost.
    GroupStopped,
    BodyStopped,
}

/// An event.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A number of cycles with a fault.
    Cycles(u32, ExchangeFault),
    /// The motor process stalls.
    StandsStill(Duration),
    Told(Ordered),
    /// An arming order that is valid for a number of cycles.
    Arm(u32),
    Acknowledge,
    /// Torque goes off for the whole body.
    TorqueOff(JointCause),
    Released,
    /// An emergency stop that lets the joint stop first.
    StopFirst,
    Alert(HardwareError),
    /// The servo restarts without becoming silent, or reboots.
    Restart,
    Reboot,
    /// Two servos with one identifier were found on the bus.
    Duplicate,
    /// Another program writes a byte.
    Written(table::Item, u8),
    PushedTo(f64),
}

/// No event for longer than the period of the condition reads.
const SETTLED: Event = Event::Cycles(145, ExchangeFault::Nothing);

fn events() -> Vec<Event> {
    use Event::*;
    let mut events = vec![Cycles(1, ExchangeFault::Nothing), Cycles(25, ExchangeFault::Nothing), SETTLED];
    let jobs = [
        ExchangeFault::JobUnheard,
        ExchangeFault::JobFirstHalf,
        ExchangeFault::JobSecondHalf,
        ExchangeFault::JobUnanswered,
        ExchangeFault::JobBroken,
        ExchangeFault::JobRefused,
        ExchangeFault::JobChecksum,
    ];
    let readings =
        [ExchangeFault::ReadingStale, ExchangeFault::ReadingUnanswered, ExchangeFault::ReadingBroken];
    events.extend(jobs.into_iter().chain(readings).flat_map(|wrong| [Cycles(1, wrong), Cycles(4, wrong)]));
    events.extend([
        Cycles(1, ExchangeFault::Deaf),
        Cycles(SILENT, ExchangeFault::Deaf),
        Cycles(1, ExchangeFault::Mute),
        Cycles(SILENT, ExchangeFault::Mute),
    ]);
    events.extend([Cycles(30, ExchangeFault::ReadingStale), Cycles(1, ExchangeFault::LineLost)]);
    events.extend([300, 10_000].map(|ms| StandsStill(Duration::from_millis(ms))));
    let orders = [Ordered::Live, Ordered::Gone, Ordered::Limp, Ordered::GroupStopped, Ordered::BodyStopped];
    events.extend(orders.map(Told));
    events.extend([
        Arm(1),
        Arm(8),
        Acknowledge,
        TorqueOff(JointCause::Emergency),
        TorqueOff(JointCause::Stopped),
    ]);
    events.extend([Released, StopFirst, Restart, Reboot, Duplicate]);
    let errors = [
        HardwareError::InputVoltage,
        HardwareError::Overheating,
        HardwareError::Encoder,
        HardwareError::ElectricalShock,
        HardwareError::Overload,
    ];
    events.extend(errors.map(Alert));
    events.extend(
        [(TORQUE_ENABLE, 0), (TORQUE_ENABLE, 1), (BUS_WATCHDOG, 0)].map(|(item, to)| Written(item, to)),
    );
    // Within the limits and far from the setpoint, a little beyond the limits, and too far beyond.
    events.extend([-0.6, 0.4, 1.4, 2.6].map(PushedTo));
    events
}

/// A joint, its bus and its servo.
#[derive(Clone)]
struct Bench {
    joint: Joint,
    bus: Bus,
    line: Line,
    now: Instant,
    orders: Ordered,
    letting_go: Option<JointCause>,
    order: u64,
    locks: u64,
    /// When the servo last changed in a way that the joint cannot detect at once.
    meddled_at: Instant,
}

/// Buffers that are reused in every exchange.
#[derive(Default)]
struct Wire {
    request: Request,
    replies: Replies,
}

impl Bench {
    fn new() -> Self {
        let robot = config::motor::parse(ONE_JOINT, "motor.toml".as_ref()).unwrap();
        let settings = config::parse(SHORT, "leo.toml".as_ref()).unwrap();
        let policy = Policy::new(&settings, true);
        Self {
            joint: Joint::new(0, Id::new(1).unwrap(), &robot.joints[0], policy, AlertReaction::Lower),
            bus: Bus::new(vec![0], false),
            line: one_servo(),
            now: Instant::from_nanos(1_000_000_000),
            orders: Ordered::Live,
            letting_go: None,
            order: 0,
            locks: 0,
            meddled_at: Instant::EPOCH,
        }
    }

    /// A joint whose servo an earlier process left with torque on, moving towards a goal.
    fn found(watchdog: u8) -> Self {
        let mut bench = Self::new();
        let servo = &mut bench.line.servos[0];
        servo.write(BUS_WATCHDOG.address, &[watchdog]).unwrap();
        servo.write(TORQUE_ENABLE.address, &[1]).unwrap();
        bench
    }

    fn apply(&mut self, event: Event, wire: &mut Wire) -> Result<(), String> {
        let (mut cycles, mut wrong, mut arms) = (1, ExchangeFault::Nothing, 0);
        match event {
            Event::Cycles(count, what) => (cycles, wrong) = (count, what),
            Event::StandsStill(time) => self.now += time,
            Event::Told(orders) => self.orders = orders,
            Event::Arm(count) => {
                self.order += 1;
                (cycles, arms) = (count, count);
            }
            Event::Acknowledge => {
                self.joint.acknowledge(self.now, self.locks, true);
                self.order += 1;
                arms = 1;
            }
            Event::TorqueOff(cause) => self.letting_go = Some(cause),
            Event::Released => {
                self.letting_go = None;
                self.joint.end_let_go();
            }
            Event::StopFirst => self.joint.end_by_emergency(),
            Event::Alert(error) => self.line.servos[0].fail(error),
            Event::Restart => self.line.servos[0].restart(),
            Event::Reboot => {
                self.line.servos[0].reboot();
                cycles = SILENT;
            }
            Event::Duplicate => self.joint.forbid(self.now, Id::new(1).unwrap()),
            Event::Written(item, byte) => {
                // The servo may refuse the write.
                let _refused = self.line.servos[0].write(item.address, &[byte]);
            }
            Event::PushedTo(to_rad) => push_to(&mut self.line, to_rad),
        }
        let is_meddling = matches!(
            event,
            Event::Alert(_) | Event::Restart | Event::Reboot | Event::Written(..) | Event::StandsStill(_)
        );
        if is_meddling {
            self.meddled_at = self.now;
        }
        for _ in 0..cycles {
            // A half-executed job is not detected before it is repeated.
            if matches!(wrong, ExchangeFault::JobFirstHalf | ExchangeFault::JobSecondHalf) {
                self.meddled_at = self.now;
            }
            self.cycle(wrong, arms > 0, wire)?;
            arms = arms.saturating_sub(1);
        }
        if event == SETTLED {
            self.check_settled()?;
        }
        Ok(())
    }

    fn cycle(&mut self, wrong: ExchangeFault, arms: bool, wire: &mut Wire) -> Result<(), String> {
        self.now += PERIOD;
        let now = self.now;
        if let Some(cause) = self.letting_go {
            self.joint.let_go(now, cause);
        }
        let (live, limp) =
            (!matches!(self.orders, Ordered::Gone | Ordered::Limp), self.orders == Ordered::Limp);
        if live {
            self.joint.set_goal(GOAL_RAD, now, now);
        }
        let body_stopped = self.bus.is_lost || self.orders == Ordered::BodyStopped;
        let group_stopped = (self.orders == Ordered::GroupStopped).then_some(JointCause::GroupStopped);
        let halt = body_stopped.then_some(JointCause::BodyStopped).or(group_stopped);
        self.joint.step(
            now,
            PERIOD.as_secs_f64(),
            BodyState { live, halt, body_stopped, limp, is_emergency: false },
        );
        if arms {
            self.joint.arm(self.order, now + Duration::from_secs(10));
        }
        self.locks += u64::from(self.joint.count_lock(self.locks));
        self.check()?;
        let arms_group = (live && !body_stopped && self.joint.is_powering_up()).then_some(0);
        let purpose = match self.letting_go {
            Some(_) => Purpose::TorqueOff,
            None => Purpose::Drive { arm_up_to: arms_group },
        };
        self.bus.plan(now, from_mut(&mut self.joint), purpose, &mut wire.request);
        if sends_goals(&wire.request) && !self.joint.may_move() {
            return Err("a goal is sent, and the joint may not move".to_owned());
        }
        exchange(&mut self.line, now, wrong, &wire.request, &mut wire.replies);
        self.bus.process_replies(now, from_mut(&mut self.joint), &wire.replies);
        let _notices = std::mem::take(&mut self.joint.notices);
        self.check()
    }

    /// Checks the invariants of every step.
    fn check(&self) -> Result<(), String> {
        let (joint, state) = (&self.joint, self.joint.state());
        let machines = state.machines().unwrap();
        check_published(&state)?;
        if machines.motion != JointMotion::Idle && !joint.may_move() {
            return Err(format!("it moves and may not: {machines:?}"));
        }
        if joint.command_counts(self.now).is_some() && !joint.may_move() {
            return Err("it has a command, and may not move".to_owned());
        }
        if joint.violations > 0 {
            return Err("a motion was not allowed, and was stopped".to_owned());
        }
        let is_known = self.now > self.meddled_at + LOOKED;
        let (torque, watchdog) = (item(&self.line, TORQUE_ENABLE), item(&self.line, BUS_WATCHDOG));
        let is_silent = !self.line.servos[0].is_listening();
        if is_known && machines.power == JointPower::On && !is_silent && (torque, watchdog) != (1, 10) {
            return Err(format!("its power is on, torque is {torque} and the watchdog {watchdog}"));
        }
        if joint.has_confirmed_torque_off() && is_known && torque != 0 {
            return Err("it has let go, and its servo has torque".to_owned());
        }
        Ok(())
    }

    /// Checks the invariants after no event for longer than the period of the condition reads.
    fn check_settled(&self) -> Result<(), String> {
        let machines = self.joint.state().machines().unwrap();
        let (torque, watchdog) = (item(&self.line, TORQUE_ENABLE), item(&self.line, BUS_WATCHDOG));
        let is_known = machines.link == JointLink::Answering && self.letting_go.is_none();
        // A servo that refuses torque off is told again, and is published as unconfirmed.
        let is_cut = machines.power == JointPower::SwitchingOff;
        if is_known && torque == 1 && watchdog != 10 && !is_cut {
            return Err(format!("it answers with torque, and its watchdog is {watchdog}: {machines:?}"));
        }
        if is_known && torque == 1 && machines.power == JointPower::Off {
            return Err(format!("it has torque, and {machines:?} says otherwise"));
        }
        Ok(())
    }

    /// Class of this state.
    fn key(&self, text: &str) -> String {
        let is_unproven = field(text, "trusted_at") != "None";
        let (power, is_armed) = (field(text, "power"), field(text, "arming").starts_with("Armed"));
        let (torque, watchdog) = (item(&self.line, TORQUE_ENABLE), item(&self.line, BUS_WATCHDOG));
        let servo = &self.line.servos[0];
        let beyond_rad = (servo.position_rad().abs() - 1.0).max(0.0);
        // Only what makes a difference in this state counts. With torque off the watchdog is armed before torque
        // comes on. Orders matter only to a joint that is armed or has torque, and a reaction only to one that moves.
        let has_power = power.starts_with("Found") || power.starts_with("On") || power.starts_with("Rising");
        let watchdog = (torque == 1 || power.starts_with("Rising")).then_some(watchdog);
        let orders = is_armed.then_some(self.orders);
        let is_limp = power != "Off" && self.orders == Ordered::Limp;
        let reaction = Some(field(text, "reaction")).filter(|_| is_armed || has_power);
        let place = [0.1, 1.0].map(|bound_rad| beyond_rad > bound_rad);
        let place = (torque == 1 || text.contains("link: Answering")).then_some(place);
        let alert = servo.has_alert() && !field(text, "arming").contains("Alert");
        let lets_go = self.letting_go.is_some();
        let rest = (torque, watchdog, orders, is_limp, reaction, place, alert, lets_go, is_unproven);
        format!("{} {rest:?}", joint_key(text))
    }

    /// The states of the four state machines.
    fn product(text: &str) -> String {
        let kind = |name: &str| {
            let value = field(text, name);
            let end = value.find(|letter: char| !letter.is_alphanumeric()).unwrap_or(value.len());
            value[..end].to_lowercase()
        };
        let let_go = if kind("let_go") == "none" { "" } else { " let-go" };
        format!("{} {} {} {}{let_go}", kind("link"), kind("power"), kind("arming"), kind("motion"))
    }
}

/// Every combination of the four state machines that is reached: link, power, arming, motion, and whether torque
/// goes off for the whole body. A developer reviews a new one before adding it.
const PRODUCTS: [&str; 66] = [
    "answering cutting armed idle",
    "answering cutting disarmed idle",
    "answering cutting disarmed idle let-go",
    "answering cutting locked idle",
    "answering cutting locked idle let-go",
    "answering found armed idle",
    "answering found disarmed idle",
    "answering found locked idle",
    "answering off armed idle",
    "answering off disarmed idle",
    "answering off disarmed idle let-go",
    "answering off locked idle",
    "answering off locked idle let-go",
    "answering on armed align",
    "answering on armed halt",
    "answering on armed hold",
    "answering on armed idle",
    "answering on armed retreat",
    "answering on armed soft",
    "answering on armed stay",
    "answering on armed track",
    "answering on disarmed idle",
    "answering on locked idle",
    "answering rising armed idle",
    "corrupt cutting disarmed idle let-go",
    "corrupt cutting locked idle",
    "corrupt cutting locked idle let-go",
    "corrupt off disarmed idle let-go",
    "corrupt off locked idle let-go",
    "corrupt unknown disarmed idle",
    "corrupt unknown locked idle",
    "identified cutting armed idle",
    "identified cutting disarmed idle",
    "identified cutting disarmed idle let-go",
    "identified cutting locked idle",
    "identified cutting locked idle let-go",
    "identified found armed idle",
    "identified found disarmed idle",
    "identified off armed idle",
    "identified off disarmed idle",
    "identified off disarmed idle let-go",
    "identified off locked idle",
    "identified off locked idle let-go",
    "identified unknown armed idle",
    "identified unknown disarmed idle",
    "identified unknown locked idle",
    "silent cutting armed idle",
    "silent cutting disarmed idle",
    "silent cutting disarmed idle let-go",
    "silent cutting locked idle",
    "silent cutting locked idle let-go",
    "silent off disarmed idle let-go",
    "silent off locked idle let-go",
    "silent unknown disarmed idle",
    "silent unknown locked idle",
    "unknown cutting disarmed idle let-go",
    "unknown cutting locked idle",
    "unknown cutting locked idle let-go",
    "unknown off armed idle",
    "unknown off disarmed idle",
    "unknown off disarmed idle let-go",
    "unknown off locked idle",
    "unknown off locked idle let-go",
    "unknown unknown armed idle",
    "unknown unknown disarmed idle",
    "unknown unknown locked idle",
];

/// A state that was reached, and how.
struct Reached {
    bench: Bench,
    before: Option<usize>,
    by: Option<Event>,
}

fn path(reached: &[Reached], mut at: usize) -> Vec<Event> {
    let mut events = Vec::new();
    while let (Some(before), Some(by)) = (reached[at].before, reached[at].by) {
        events.push(by);
        at = before;
    }
    events.reverse();
    events
}

#[test]
fn no_event_in_any_joint_state_moves_without_the_watchdog() {
    let (events, mut wire) = (events(), Wire::default());
    let (mut keys, mut reached, mut open) = (HashMap::new(), Vec::new(), VecDeque::new());
    let (mut products, mut failures) = (BTreeSet::new(), BTreeMap::new());
    let mut steps = 0_u64;
    for bench in [Bench::new(), Bench::found(0), Bench::found(10)] {
        let text = format!("{:?}", bench.joint);
        products.insert(Bench::product(&text));
        if keys.insert(bench.key(&text), reached.len()).is_none() {
            open.push_back(reached.len());
            reached.push(Reached { bench, before: None, by: None });
        }
    }
    while let Some(at) = open.pop_front() {
        for &event in &events {
            // With torque off a condition read finds nothing that a shorter time does not.
            if event == SETTLED && item(&reached[at].bench.line, TORQUE_ENABLE) == 0 {
                continue;
            }
            let mut bench = reached[at].bench.clone();
            steps += 1;
            if let Err(failure) = bench.apply(event, &mut wire) {
                let mut events = path(&reached, at);
                events.push(event);
                failures.entry(failure).or_insert(events);
                continue;
            }
            let text = format!("{:?}", bench.joint);
            products.insert(Bench::product(&text));
            let key = bench.key(&text);
            if let Entry::Vacant(place) = keys.entry(key) {
                place.insert(reached.len());
                open.push_back(reached.len());
                reached.push(Reached { bench, before: Some(at), by: Some(event) });
            }
        }
    }
    println!("{} states, {steps} steps, {} products", reached.len(), products.len());
    assert!(failures.is_empty(), "{failures:#?}");
    let (new, gone): (Vec<_>, Vec<_>) = {
        let known: BTreeSet<&str> = PRODUCTS.into_iter().collect();
        let reached: BTreeSet<&str> = products.iter().map(String::as_str).collect();
        (reached.difference(&known).copied().collect(), known.difference(&reached).copied().collect())
    };
    assert!(new.is_empty() && gone.is_empty(), "new: {new:#?}, no longer reached: {gone:#?}");
}

/// The state after these events.
fn after(events: &[Event]) -> Bench {
    let (mut bench, mut wire) = (Bench::new(), Wire::default());
    for event in events {
        bench.apply(*event, &mut wire).unwrap();
    }
    bench
}

#[test]
fn torque_switched_on_by_another_master_during_an_alert_goes_off() {
    let alert = Event::Alert(HardwareError::InputVoltage);
    let written = Event::Written(TORQUE_ENABLE, 1);
    let cycles = |count| Event::Cycles(count, ExchangeFault::Nothing);
    let bench = after(&[cycles(25), alert, written, cycles(145)]);
    assert_eq!(item(&bench.line, TORQUE_ENABLE), 0);
}

#[test]
fn an_alert_switches_torque_off_on_a_locked_joint() {
    let held = [Event::Told(Ordered::GroupStopped), Event::Arm(8), Event::PushedTo(2.6)];
    let cycles = |count| Event::Cycles(count, ExchangeFault::Nothing);
    for error in [HardwareError::Overheating, HardwareError::InputVoltage] {
        let bench = after(&[&held[..], &[cycles(25), Event::Alert(error), cycles(145)]].concat());
        let machines = bench.joint.state().machines().unwrap();
        assert_eq!((machines.power, machines.arming_cause), (JointPower::Off, JointCause::BeyondLimits));
        assert_eq!(item(&bench.line, TORQUE_ENABLE), 0);
    }
}

#[test]
fn a_tripped_watchdog_is_detected_during_an_alert() {
    let cycles = |count| Event::Cycles(count, ExchangeFault::Nothing);
    // The machine stalls while the supply sags. Every cycle checks that power that is on includes an armed watchdog.
    after(&[
        Event::Arm(8),
        Event::PushedTo(1.4),
        cycles(25),
        Event::Cycles(14, ExchangeFault::Deaf),
        Event::Duplicate,
        Event::Acknowledge,
        Event::Told(Ordered::GroupStopped),
        Event::Cycles(4, ExchangeFault::JobSecondHalf),
        Event::StandsStill(Duration::from_millis(300)),
        Event::Alert(HardwareError::InputVoltage),
        cycles(145),
    ]);
}
