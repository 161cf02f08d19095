//! A task that is taught while the network is bad.

use std::fs;
use std::path::Path;

use clock::Duration;

use crate::machine::{Machine, pause, wait_until};
use crate::network::Network;
use crate::{PERFORMED, Side, alone, keys_or_skip};

/// How long the network is cut.
const CUT: Duration = Duration::from_secs(10);
/// How often the task is shown.
const SHOWN: u64 = 12;

/// The lesson of Task 1, with its demonstrations by turns.
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

/// How many examples it was said that there are, each time that it was said.
fn counted(machine: &Machine) -> Vec<u64> {
    let told = machine.told();
    let count = |line: &str| {
        let (before, _) = line.split_once(" of task 1 so far")?;
        let (before, _) = before.rsplit_once(' ')?;
        before.rsplit_once(' ')?.1.parse().ok()
    };
    told.lines().filter_map(count).collect()
}

/// What Leo says of a showing that it heard too late of.
const UNSEEN: &str =
    "I do not know how things were when you said that: this showing of task 1 does not count";
/// What it says of one that it understood wrong.
const CONFUSED: &str = "no rule that I know explains";

/// How often it was said that a showing is being watched.
fn watched(machine: &Machine) -> usize {
    machine.told().matches("watches how to do task 1").count()
}

#[test]
fn what_was_learned_over_a_bad_network_is_right_and_stays_learned() {
    let _alone = alone();
    let Some(mut network) = Network::or_skip("taught") else { return };
    let [a, b] = network.names.clone();
    let Some(keys) = keys_or_skip("IP:10.77.0.1") else { return };
    let away = Side::away("quic/10.77.0.1:7447").keyed(keys.path(), "away");
    let mut away = Machine::ready(Some(&b), "ns-pupil", &away.changes());
    let robot = Side::robot("quic/10.77.0.1:7447").keyed(keys.path(), "robot");
    let lesson = keys.path().join("lesson.toml");
    fs::write(&lesson, long_lesson()).expect("writes");
    let lesson = ["--lesson", lesson.to_str().expect("is text")];
    let mut robot = Machine::start_with(Some(&a), "ns-table", &robot.changes(), &lesson).when_ready();
    let holds = |away: &Machine, count| wait_until(|| counted(away).len() >= count);
    let all = |away: &Machine, robot: &Machine| format!("{}\n{}\n{}", away.told(), away.said(), robot.said());
    assert!(holds(&away, 2), "{}", all(&away, &robot));

    // What is shown over a slow network that loses packets is learned as ever, where it comes in time.
    network.set("200 0.05");
    assert!(holds(&away, 3), "{}", all(&away, &robot));
    let before = watched(&away);
    assert!(wait_until(|| watched(&away) > before), "{}", all(&away, &robot));

    // The end of this showing is said while nobody hears it.
    network.set("cut");
    let (examples, unseen) = (counted(&away), away.told().matches(UNSEEN).count());
    pause(CUT);
    assert_eq!(counted(&away), examples, "{}", all(&away, &robot));
    network.set("0 0");
    let heard = || away.told().matches(UNSEEN).count() > unseen;
    assert!(wait_until(heard), "it recovers by itself, and tells that showing apart\n{}", all(&away, &robot));
    // The board tells of it within a tenth of a second.
    let heard_again = || away.metric("leo_link_hearings_total") >= 2.0;
    assert!(wait_until(heard_again), "{}", all(&away, &robot));
    assert!(holds(&away, examples.len() + 2), "{}", all(&away, &robot));
    assert!(wait_until(|| away.told().contains(PERFORMED)), "{}", all(&away, &robot));

    // What was said to be learned is never taken back, and each showing counts once at most, as it was.
    let told = counted(&away);
    let last = u64::try_from(told.len()).expect("few");
    println!("{SHOWN} showings, {last} examples");
    assert_eq!(told, (1..=last).collect::<Vec<_>>(), "{}", all(&away, &robot));
    assert!(last < SHOWN && !away.told().contains(CONFUSED), "{}", all(&away, &robot));
    for machine in [&mut away, &mut robot] {
        let (status, said) = machine.stop();
        assert!(status.success(), "{status}\n{said}");
    }
    assert_eq!(away.learned(), [("task 1".to_owned(), last)].into());
}
