use std::sync::LazyLock;

use config::Robot;
use proptest::prelude::*;
use settings::number::Milliseconds;

use super::*;

const MAX_DEATHS: u32 = 5;

static SETTINGS: LazyLock<Supervisor> = LazyLock::new(|| {
    let ms = |value: f64| Milliseconds::try_from(value).unwrap();
    Supervisor {
        ready_timeout_ms: ms(1000.0),
        heartbeat_timeout_ms: ms(100.0),
        heartbeat_timeout_others_ms: ms(500.0),
        initial_backoff_ms: ms(20.0),
        max_backoff_ms: ms(100.0),
        max_deaths: MAX_DEATHS,
        deaths_window_ms: ms(10_000.0),
        stop_timeout_ms: ms(200.0),
        ..Robot::load(None).unwrap().leo.supervisor
    }
});

const ORDER: [Process; 3] = [Process::Motor, Process::Belief, Process::Sensor];

fn at(ms: u64) -> Instant {
    Instant::from_nanos(ms * 1_000_000)
}

fn heartbeat(process: Process, beat: u64) -> Event {
    Event::Heartbeat { process, state: ProcessState::Running, beat }
}

fn start(process: Process, incarnation: u64) -> Action {
    Action::Start { process, incarnation }
}

/// A policy whose processes all run, with a first heartbeat at 0 ms.
fn running() -> Policy {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    policy.step(at(0), &[]);
    for process in ORDER {
        policy.step(at(0), &[heartbeat(process, 1)]);
    }
    assert!(!policy.is_busy());
    policy
}

fn all_beat(beat: u64) -> Vec<Event> {
    ORDER.map(|process| heartbeat(process, beat)).to_vec()
}

#[test]
fn each_process_starts_when_the_previous_one_is_ready() {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    assert_eq!(policy.step(at(0), &[]), [start(Process::Motor, 1)]);
    let starting = Event::Heartbeat { process: Process::Motor, state: ProcessState::Starting, beat: 1 };
    assert_eq!(policy.step(at(1), &[starting]), []);
    assert_eq!(policy.step(at(2), &[heartbeat(Process::Motor, 1)]), [start(Process::Belief, 1)]);
    assert_eq!(policy.step(at(3), &[heartbeat(Process::Belief, 1)]), [start(Process::Sensor, 1)]);
    assert_eq!(policy.step(at(4), &[heartbeat(Process::Sensor, 1)]), [Action::AllReady]);
    assert_eq!(policy.step(at(5), &[]), []);
}

#[test]
fn a_process_that_is_not_ready_in_time_is_killed() {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    policy.step(at(0), &[]);
    assert_eq!(policy.step(at(1000), &[]), []);
    assert_eq!(policy.step(at(1001), &[]), [Action::Kill(Process::Motor, KillReason::NotReady)]);
    assert_eq!(policy.step(at(1100), &[]), [], "killed once");
    let died = Event::Died(Process::Motor, ExitKind::Failed);
    assert_eq!(policy.step(at(1101), &[died]), [Action::CleanUp]);
    assert_eq!(policy.step(at(1200), &[Event::CleanedUp]), [start(Process::Motor, 2)]);
}

#[test]
fn a_process_without_a_new_heartbeat_is_killed_as_hung() {
    let mut policy = running();
    assert_eq!(policy.step(at(50), &all_beat(1)), []);
    assert_eq!(policy.step(at(100), &all_beat(1)), [], "just not too long");
    let mut beats = all_beat(2);
    beats[1] = heartbeat(Process::Belief, 1);
    assert_eq!(policy.step(at(101), &beats), [Action::Kill(Process::Belief, KillReason::Hangs)]);
}

#[test]
fn a_supervisor_that_was_suspended_kills_no_process_that_kept_beating() {
    let mut policy = running();
    assert_eq!(policy.step(at(60_000), &all_beat(900)), []);
}

#[test]
fn the_hot_path_has_a_shorter_heartbeat_timeout_than_disk_users() {
    let all = [Process::Motor, Process::Learner, Process::Console];
    let mut policy = Policy::new(SETTINGS.clone(), &all, at(0));
    for process in all {
        policy.step(at(0), &[]);
        policy.step(at(0), &[heartbeat(process, 1)]);
    }
    let mut killed = Vec::new();
    for ms in (0..1000).step_by(10) {
        let actions = policy.step(at(ms), &[]);
        for action in actions {
            if let Action::Kill(process, _) = action {
                killed.push((process, ms));
            }
        }
    }
    assert_eq!(killed, [(Process::Motor, 110), (Process::Learner, 510), (Process::Console, 510)]);
}

#[test]
fn a_suspended_machine_kills_no_process_and_hangs_are_still_found() {
    let mut policy = running();
    assert_eq!(policy.step(at(60_000), &all_beat(1)), [], "nobody had the time to beat");
    let mut beats = all_beat(2);
    beats[1] = heartbeat(Process::Belief, 1);
    assert_eq!(policy.step(at(60_025), &beats), []);
    assert_eq!(policy.step(at(60_050), &beats), []);
    assert_eq!(policy.step(at(60_051), &beats), [Action::Kill(Process::Belief, KillReason::Hangs)]);
}

#[test]
fn no_process_starts_before_the_clean_up_after_dead_ones() {
    let mut policy = running();
    let died = Event::Died(Process::Belief, ExitKind::Failed);
    assert_eq!(policy.step(at(1), &[died]), [Action::CleanUp]);
    assert_eq!(policy.step(at(80), &[]), []);
    // Another process dies during the clean-up: the first answer does not cover it.
    let died = Event::Died(Process::Sensor, ExitKind::Failed);
    assert_eq!(policy.step(at(81), &[died]), []);
    assert_eq!(policy.step(at(82), &[Event::CleanedUp]), [Action::CleanUp]);
    let restarts = policy.step(at(101), &[Event::CleanedUp, heartbeat(Process::Motor, 2)]);
    assert_eq!(restarts, [start(Process::Belief, 2), start(Process::Sensor, 2)]);
}

#[test]
fn no_clean_up_runs_while_another_process_starts() {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    policy.step(at(0), &[]);
    assert_eq!(policy.step(at(1), &[heartbeat(Process::Motor, 1)]), [start(Process::Belief, 1)]);
    assert_eq!(policy.step(at(2), &[Event::Died(Process::Motor, ExitKind::Failed)]), []);
    assert_eq!(policy.step(at(30), &[heartbeat(Process::Belief, 1)]), [Action::CleanUp]);
}

#[test]
fn the_wait_before_a_restart_doubles_up_to_its_bound() {
    let settings = Supervisor { max_deaths: u32::MAX, ..SETTINGS.clone() };
    let mut policy = Policy::new(settings, &[Process::Motor], at(0));
    policy.step(at(0), &[]);
    let mut now = 0;
    for (incarnation, wait) in [20, 40, 80, 100, 100].into_iter().enumerate() {
        policy.step(at(now), &[Event::Died(Process::Motor, ExitKind::Failed)]);
        assert_eq!(policy.step(at(now + wait - 1), &[Event::CleanedUp]), []);
        now += wait;
        let next = u64::try_from(incarnation).unwrap() + 2;
        assert_eq!(policy.step(at(now), &[]), [start(Process::Motor, next)]);
    }
    // An incarnation that lasted as long as the window resets the delay.
    policy.step(at(now), &[heartbeat(Process::Motor, 1)]);
    now += 10_000;
    policy.step(at(now), &[heartbeat(Process::Motor, 2), Event::Died(Process::Motor, ExitKind::Failed)]);
    assert_eq!(policy.step(at(now + 20), &[Event::CleanedUp]).len(), 1);
}

#[test]
fn too_many_deaths_end_the_run_and_stop_processes_in_reverse() {
    let mut policy = running();
    let mut now = 0;
    let mut beat = 1;
    for _death in 0..4 {
        beat += 1;
        assert_eq!(policy.step(at(now), &[Event::Died(Process::Motor, ExitKind::Failed)]), [Action::CleanUp]);
        policy.step(at(now), &[Event::CleanedUp]);
        now += 100;
        assert_eq!(policy.step(at(now), &all_beat(beat)).len(), 1, "restarted");
        policy.step(at(now), &all_beat(beat));
    }
    let last = policy.step(at(now), &[Event::Died(Process::Motor, ExitKind::Failed)]);
    assert_eq!(last, [Action::SwitchTorqueOff, Action::Terminate(Process::Sensor)]);
    let next = policy.step(at(now + 1), &[Event::Died(Process::Sensor, ExitKind::Done)]);
    assert_eq!(next, [Action::Terminate(Process::Belief)]);
    assert_eq!(policy.step(at(now + 2), &[Event::Died(Process::Belief, ExitKind::Done)]), []);
    let end = policy.step(at(now + 3), &[Event::TorqueIsOff]);
    assert_eq!(end, [Action::End(Outcome::GaveUp(Process::Motor))]);
}

#[test]
fn deaths_spread_wider_than_the_window_never_end_the_run() {
    let mut policy = running();
    let mut restarts = 0;
    for death in 0..50_u64 {
        let now = death * 2600;
        policy.step(at(now), &all_beat(3 * death + 2));
        policy.step(at(now), &[Event::Died(Process::Sensor, ExitKind::Failed)]);
        let actions = policy.step(at(now + 100), &[vec![Event::CleanedUp], all_beat(3 * death + 3)].concat());
        restarts += actions.len();
        policy.step(at(now + 101), &all_beat(3 * death + 4));
    }
    assert_eq!(restarts, 50);
}

#[test]
fn a_process_that_completes_its_work_ends_the_run_successfully() {
    let mut policy = running();
    let actions = policy.step(at(1), &[Event::Died(Process::Sensor, ExitKind::Done)]);
    assert_eq!(actions, [Action::Terminate(Process::Motor), Action::Terminate(Process::Belief)]);
    policy.step(at(2), &[Event::Died(Process::Belief, ExitKind::Failed)]);
    let end = policy.step(at(3), &[Event::Died(Process::Motor, ExitKind::Done)]);
    assert_eq!(end, [Action::End(Outcome::Done(Process::Sensor))]);
}

#[test]
fn a_process_that_refuses_its_configuration_is_not_started_again() {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    policy.step(at(0), &[]);
    let off = policy.step(at(1), &[Event::Died(Process::Motor, ExitKind::Refused)]);
    assert_eq!(off, [Action::SwitchTorqueOff]);
    let end = policy.step(at(2), &[Event::TorqueIsOff]);
    assert_eq!(end, [Action::End(Outcome::Refused(Process::Motor))]);
}

#[test]
fn a_process_that_does_not_stop_is_killed() {
    let mut policy = running();
    let first = [Action::Terminate(Process::Motor), Action::Terminate(Process::Sensor)];
    assert_eq!(policy.step(at(0), &[Event::Stop]), first);
    policy.step(at(100), &all_beat(2));
    assert_eq!(policy.step(at(200), &all_beat(3)), []);
    let killed =
        [Process::Motor, Process::Sensor].map(|process| Action::Kill(process, KillReason::DoesNotStop));
    assert_eq!(policy.step(at(201), &[]), killed);
    // No process has switched torque off.
    let off = policy.step(at(202), &[Event::Died(Process::Motor, ExitKind::Failed)]);
    assert_eq!(off, [Action::SwitchTorqueOff]);
}

/// The servos' processes, and one other.
const WITH_SERVOS: [Process; 3] = [Process::MockBus, Process::Motor, Process::Sensor];

fn running_with_servos() -> Policy {
    let mut policy = Policy::new(SETTINGS.clone(), &WITH_SERVOS, at(0));
    policy.step(at(0), &[]);
    for process in WITH_SERVOS {
        policy.step(at(0), &[heartbeat(process, 1)]);
    }
    policy
}

#[test]
fn a_second_stop_request_kills_all_but_the_torque_off_processes() {
    let mut policy = running_with_servos();
    policy.step(at(0), &[Event::Stop]);
    assert_eq!(policy.step(at(1), &[Event::Stop]), [Action::Kill(Process::Sensor, KillReason::Hurry)]);
    assert_eq!(policy.step(at(2), &[Event::Stop, Event::Stop]), []);
    assert_eq!(policy.step(at(3), &[Event::Died(Process::Sensor, ExitKind::Failed)]), []);
    let motor_is_gone = policy.step(at(4), &[Event::Died(Process::Motor, ExitKind::Done)]);
    assert_eq!(motor_is_gone, [Action::Kill(Process::MockBus, KillReason::Hurry)]);
    let end = policy.step(at(5), &[Event::Died(Process::MockBus, ExitKind::Failed)]);
    assert_eq!(end, [Action::End(Outcome::Stopped)]);
}

#[test]
fn ctrl_c_hurries_the_end_and_a_second_hang_up_does_not() {
    let mut policy = running();
    let first = [Action::Terminate(Process::Motor), Action::Terminate(Process::Sensor)];
    assert_eq!(policy.step(at(0), &[Event::HangUp]), first);
    assert_eq!(policy.step(at(1), &[Event::HangUp]), []);
    let hurried = [Process::Belief, Process::Sensor].map(|process| Action::Kill(process, KillReason::Hurry));
    assert_eq!(policy.step(at(2), &[Event::Stop]), hurried);
    let mut policy = running();
    policy.step(at(0), &[Event::Stop]);
    assert_eq!(policy.step(at(1), &[Event::HangUp]), [], "the terminal is closed after Ctrl-C");
}

#[test]
fn the_mock_servo_bus_ends_after_the_motor_process_and_torque_off() {
    let mut policy = running_with_servos();
    let first = [Action::Terminate(Process::Motor), Action::Terminate(Process::Sensor)];
    assert_eq!(policy.step(at(0), &[Event::Stop]), first);
    assert_eq!(policy.step(at(1), &[Event::Died(Process::Sensor, ExitKind::Failed)]), []);
    let off = policy.step(at(2), &[Event::Died(Process::Motor, ExitKind::Failed)]);
    assert_eq!(off, [Action::SwitchTorqueOff]);
    assert_eq!(policy.step(at(3), &[]), []);
    assert_eq!(policy.step(at(4), &[Event::TorqueIsOff]), [Action::Terminate(Process::MockBus)]);
    let end = policy.step(at(5), &[Event::Died(Process::MockBus, ExitKind::Failed)]);
    assert_eq!(end, [Action::End(Outcome::Stopped)]);
}

#[test]
fn a_stop_between_two_motor_processes_switches_torque_off() {
    let mut policy = running();
    policy.step(at(1), &[Event::Died(Process::Motor, ExitKind::Failed)]);
    let stopped = policy.step(at(2), &[Event::Stop]);
    assert_eq!(stopped, [Action::SwitchTorqueOff, Action::Terminate(Process::Sensor)]);
    // After an orderly exit nothing has to be switched off.
    let mut policy = running();
    policy.step(at(1), &[Event::Died(Process::Motor, ExitKind::Done)]);
    assert_eq!(policy.step(at(2), &[Event::Stop]), [Action::Terminate(Process::Sensor)]);
    // Before the first start nothing has to be switched off.
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    assert_eq!(policy.step(at(0), &[Event::Stop]), [Action::End(Outcome::Stopped)]);
}

#[test]
fn removed_memory_is_reported_instead_of_the_death_it_causes() {
    let mut policy = running();
    let died = Event::Died(Process::Belief, ExitKind::Refused);
    let actions = policy.step(at(1), &[Event::MemoryRemoved, died]);
    assert_eq!(actions, [Action::Terminate(Process::Motor), Action::Terminate(Process::Sensor)]);
    policy.step(at(2), &[Event::Died(Process::Sensor, ExitKind::Done)]);
    let end = policy.step(at(3), &[Event::Died(Process::Motor, ExitKind::Done)]);
    assert_eq!(end, [Action::End(Outcome::MemoryRemoved)]);
}

#[test]
fn an_elapsed_run_time_does_not_hurry_the_end() {
    for (first, second) in [(Event::Stop, Event::TimeIsOver), (Event::TimeIsOver, Event::Stop)] {
        let mut policy = running();
        assert_eq!(policy.step(at(0), &[first]).len(), 2, "the motor process and the last of the others");
        assert_eq!(policy.step(at(1), &[second]), []);
        let hurried = policy.step(at(2), &[Event::Stop]);
        assert_eq!(
            hurried,
            [Process::Belief, Process::Sensor].map(|process| Action::Kill(process, KillReason::Hurry))
        );
    }
}

#[test]
fn a_failing_run_ends_the_same_when_it_is_stopped_meanwhile() {
    for (ended, outcome, deaths) in [
        (ExitKind::Refused, Outcome::Refused(Process::Motor), 1),
        (ExitKind::Failed, Outcome::GaveUp(Process::Motor), MAX_DEATHS),
    ] {
        let mut policy = running();
        let mut actions = Vec::new();
        for death in 1..=deaths {
            actions = policy.step(at(0), &[Event::Died(Process::Motor, ended)]);
            if death < deaths {
                policy.step(at(0), &[Event::CleanedUp]);
                policy.step(at(0), &[heartbeat(Process::Motor, 1)]);
            }
        }
        let expected = [Action::SwitchTorqueOff, Action::Terminate(Process::Sensor)];
        assert_eq!(actions, expected, "the others stop in order");
        // This is the first stop request, so it kills no process.
        assert_eq!(policy.step(at(1), &[Event::Stop]), []);
        let next = policy.step(at(2), &[Event::Died(Process::Sensor, ExitKind::Done)]);
        assert_eq!(next, [Action::Terminate(Process::Belief)]);
        let end = policy.step(at(3), &[Event::Died(Process::Belief, ExitKind::Done), Event::TorqueIsOff]);
        assert_eq!(end, [Action::End(outcome)]);
    }
}

#[test]
fn the_robot_state_is_good_while_every_heartbeat_advances() {
    let mut policy = Policy::new(SETTINGS.clone(), &ORDER, at(0));
    let mut wording = vec![policy.robot_state().to_string()];
    assert!(wording[0].contains("0 of 3"), "{wording:?}");
    assert!(!policy.robot_state().is_well());
    policy = running();
    assert!(policy.robot_state().is_well());
    wording.push(policy.robot_state().to_string());
    let mut beats = all_beat(2);
    beats[1] = heartbeat(Process::Belief, 1);
    policy.step(at(30), &[]);
    policy.step(at(60), &beats);
    policy.step(at(101), &beats);
    assert!(!policy.robot_state().is_well(), "it hangs, and its killed process was not buried yet");
    wording.push(policy.robot_state().to_string());
    assert!(wording[2].contains("2 of 3"), "{wording:?}");
    policy.step(at(110), &[Event::Died(Process::Belief, ExitKind::Failed)]);
    assert!(!policy.robot_state().is_well(), "it waits");
    policy.step(at(140), &[Event::CleanedUp]);
    assert!(!policy.robot_state().is_well(), "it starts");
    policy.step(at(150), &[heartbeat(Process::Belief, 1)]);
    assert!(policy.robot_state().is_well());
    policy.step(at(151), &[Event::Stop]);
    assert!(!policy.robot_state().is_well());
    wording.push(policy.robot_state().to_string());
    assert!(wording[3].contains("1 of 3"), "{wording:?}");
    insta::assert_snapshot!(wording.join("\n"));
}

/// Random events: processes die, hang and get cleaned up.
#[derive(Clone, Copy, Debug)]
enum Chance {
    Die(usize),
    Hang(usize),
    Clean,
    Wait(u64),
}

fn chance() -> impl Strategy<Value = Chance> {
    prop_oneof![
        (0..ORDER.len()).prop_map(Chance::Die),
        (0..ORDER.len()).prop_map(Chance::Hang),
        Just(Chance::Clean),
        (1_u64..150).prop_map(Chance::Wait),
    ]
}

proptest! {
    #[test]
    fn no_process_ever_runs_twice_and_every_stop_ends(chances in prop::collection::vec(chance(), 0..300)) {
        let settings = Supervisor { max_deaths: u32::MAX, ..SETTINGS.clone() };
        let mut policy = Policy::new(settings, &ORDER, at(0));
        let mut alive = [false; ORDER.len()];
        let mut hangs = [false; ORDER.len()];
        let mut cleaning = false;
        let mut incarnations = [0; ORDER.len()];
        let (mut now, mut beat) = (0, 0);
        let mut ended = false;
        // Whether a motor process has started since torque was switched off.
        let mut torque = false;
        let stop = [Chance::Wait(1)];
        for (turn, chance) in chances.iter().chain(stop.iter().cycle()).enumerate().take(chances.len() + 2000) {
            beat += 1;
            let mut events = Vec::new();
            match *chance {
                Chance::Die(index) if alive[index] => {
                    alive[index] = false;
                    events.push(Event::Died(ORDER[index], ExitKind::Failed));
                }
                Chance::Hang(index) => hangs[index] = true,
                Chance::Clean if cleaning => {
                    cleaning = false;
                    events.push(Event::CleanedUp);
                }
                Chance::Wait(ms) => now += ms,
                Chance::Die(_) | Chance::Clean => {}
            }
            if turn == chances.len() {
                events.push(Event::Stop);
            }
            for index in (0..ORDER.len()).filter(|&index| alive[index] && !hangs[index]) {
                events.push(heartbeat(ORDER[index], beat));
            }
            // The consequences of an action reach the policy in a separate step.
            while !ended {
                let actions = policy.step(at(now), &events);
                events.clear();
                for action in actions {
                    let place = |process| ORDER.iter().position(|&it| it == process).unwrap();
                    match action {
                        Action::Start { process, incarnation } => {
                            let index = place(process);
                            prop_assert!(!alive[index] && !cleaning);
                            prop_assert!(turn < chances.len());
                            incarnations[index] += 1;
                            torque |= process == Process::Motor;
                            prop_assert_eq!(incarnation, incarnations[index]);
                            (alive[index], hangs[index]) = (true, false);
                        }
                        Action::Terminate(process) if hangs[place(process)] => {}
                        Action::Terminate(process) | Action::Kill(process, _) => {
                            prop_assert!(alive[place(process)]);
                            alive[place(process)] = false;
                            events.push(Event::Died(process, ExitKind::Failed));
                        }
                        Action::CleanUp => {
                            prop_assert!(!cleaning);
                            cleaning = true;
                        }
                        Action::AllReady => {}
                        Action::SwitchTorqueOff => {
                            prop_assert!(!alive[place(Process::Motor)] && torque);
                            torque = false;
                            events.push(Event::TorqueIsOff);
                        }
                        Action::End(outcome) => {
                            prop_assert!(!torque);
                            prop_assert_eq!(outcome, Outcome::Stopped);
                            prop_assert_eq!(alive, [false; ORDER.len()]);
                            ended = true;
                        }
                    }
                }
                if events.is_empty() {
                    break;
                }
            }
        }
        prop_assert!(ended);
    }
}

#[test]
fn a_robot_runs_on_without_a_link_however_often_it_dies() {
    let mut policy = Policy::new(SETTINGS.clone(), &[Process::Motor, Process::Link], at(0));
    let beats = |beat| [heartbeat(Process::Motor, beat), heartbeat(Process::Link, beat)];
    policy.step(at(0), &[]);
    let mut now = 1;
    for life in 1..50 {
        policy.step(at(now), &beats(now));
        policy.step(at(now + 1), &beats(now + 1));
        let died = Event::Died(Process::Link, ExitKind::Failed);
        assert_eq!(policy.step(at(now + 2), &[died]), [Action::CleanUp], "life {life}");
        policy.step(at(now + 3), &[Event::CleanedUp]);
        now += 3;
        let mut started = false;
        while !started {
            now += 1;
            started =
                policy.step(at(now), &[heartbeat(Process::Motor, now)]) == [start(Process::Link, life + 1)];
        }
    }
}
