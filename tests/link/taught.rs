//! A task taught over a bad network.

use std::fs;
use std::path::Path;

use clock::Duration;

use crate::machine::{Machine, pause, wait_until};
use crate::network::Network;
use crate::{PERFORMED, Side, alone, keys_or_skip};

/// Duration of the network failure.
const CUT: Duration = Duration::from_secs(10);
/// Number of demonstrations.
const SHOWN: u64 = 9;

/// The lesson of Task 1, with its demonstrations in turn.
fn long_lesson() -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/lessons/task1.toml");
    let text = fs::read_to_string(file).expect("the lesson");
    let (demonstrations, novel) = text.split_once("[novel]").expect("a novel set");
    let mut parts = demonstrations.split("[[demonstration]]");
    let head = parts.next().expect("a head").to_owned();
    let parts: Vec<&str> = parts.collect();
    let shown = parts.iter().cycle().take(usize::try_from(SHOWN).expect("few"));
    let shown: String = shown.map(|part| format!("[[demonstration]]{part}")).collect();
    head + &shown + "[novel]" + novel
}

/// The numbers of examples in the console's reports, in order.
fn counted(machine: &Machine) -> Vec<u64> {
    let told = machine.stdout();
    let count = |line: &str| {
        let (before, _) = line.split_once(" of task 1 so far")?;
        let (before, _) = before.rsplit_once(' ')?;
        before.rsplit_once(' ')?.1.parse().ok()
    };
    told.lines().filter_map(count).collect()
}

/// Leo's answer to a demonstration whose beginning or end arrived too late.
const UNSEEN: &str =
    "I do not know how things were when you said that: this showing of task 1 does not count";
/// Leo's answer to examples without a common rule.
const CONFUSED: &str = "no rule that I know explains";

/// Number of demonstrations that Leo reported to watch.
fn watched(machine: &Machine) -> usize {
    machine.stdout().matches("watches how to do task 1").count()
}

#[test]
fn tasks_learned_over_a_bad_network_are_correct_and_kept() {
    let _alone = alone();
    let Some(mut network) = Network::or_skip("taught") else { return };
    let [a, b] = network.names.clone();
    let Some(keys) = keys_or_skip("IP:10.77.0.1") else { return };
    let away = Side::remote("quic/10.77.0.1:7447").keyed(keys.path(), "remote");
    let mut away = Machine::ready(Some(&b), "ns-pupil", &away.changes());
    let robot = Side::robot("quic/10.77.0.1:7447").keyed(keys.path(), "robot");
    let lesson = keys.path().join("lesson.toml");
    fs::write(&lesson, long_lesson()).expect("writes");
    let lesson = ["--lesson", lesson.to_str().expect("is text")];
    let mut robot = Machine::start_with(Some(&a), "ns-table", &robot.changes(), &lesson).when_ready();
    let holds = |away: &Machine, count| wait_until(|| counted(away).len() >= count);
    let all =
        |away: &Machine, robot: &Machine| format!("{}\n{}\n{}", away.stdout(), away.said(), robot.said());
    assert!(holds(&away, 2), "{}", all(&away, &robot));

    // Over a slow and lossy network, demonstrations that arrive in time are learned as usual.
    network.set("200 0.05");
    assert!(holds(&away, 3), "{}", all(&away, &robot));
    let before = watched(&away);
    assert!(wait_until(|| watched(&away) > before), "{}", all(&away, &robot));

    // The end of this demonstration is said during the failure.
    network.set("cut");
    let (examples, unseen) = (counted(&away), away.stdout().matches(UNSEEN).count());
    pause(CUT);
    assert_eq!(counted(&away), examples, "{}", all(&away, &robot));
    network.set("0 0");
    let heard = || away.stdout().matches(UNSEEN).count() > unseen;
    assert!(wait_until(heard), "it recovers by itself, and tells that showing apart\n{}", all(&away, &robot));
    // The health board shows it within 0.1 s.
    let heard_again = || away.metric("leo_link_sessions_total") >= 2.0;
    assert!(wait_until(heard_again), "{}", all(&away, &robot));
    assert!(holds(&away, examples.len() + 2), "{}", all(&away, &robot));
    assert!(wait_until(|| away.stdout().contains(PERFORMED)), "{}", all(&away, &robot));

    // An acknowledged example is never withdrawn, and each demonstration counts at most once.
    let told = counted(&away);
    let last = u64::try_from(told.len()).expect("few");
    println!("{SHOWN} showings, {last} examples");
    assert_eq!(told, (1..=last).collect::<Vec<_>>(), "{}", all(&away, &robot));
    assert!(last < SHOWN && !away.stdout().contains(CONFUSED), "{}", all(&away, &robot));
    for machine in [&mut away, &mut robot] {
        let (status, said) = machine.stop();
        assert!(status.success(), "{status}\n{said}");
    }
    assert_eq!(away.learned(), [("task 1".to_owned(), last)].into());
}
