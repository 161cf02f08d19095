//! Every command line of the documents, and how it is tried.

use Step::{ByHand, Line};
use Trial::{Ends, Fails, Interrupted, NotRun, Says, Stays};

use super::by_hand;
use super::session::Session;
use super::trial::Trial;

const BUILDS: &str = "builds for minutes";
const EVERY_TEST: &str = "runs the tests, and this is one";
const MINUTES: &str = "takes minutes; `tests/commands/study.rs` runs it";
const MEASURES: &str = "measures for 21 minutes on a quiet machine";
const NETWORK: &str = "needs the network; the session has such an environment already";
const PUBLIC_DATA: &str = "needs the network; the data may not be copied";
const SERVOS: &str = "needs servos on a serial line; `tests/masters` tries it on simulated ones";
const ROOT: &str = "needs root";
const INSTALLED: &str = "needs the installed package; `package/boot.sh` tries its service";
const EVERY_ROBOT: &str = "stops every robot of this machine, also those of other tests";
const PAGE: &str = "needs the robot of the service at port 7780; `tests/page` asks one of its own";
const BROWSER: &str = "needs a browser; `tests/page/browser.rs` runs the script";
const ONLY_ROBOT: &str =
    "needs the only robot of this machine; `tests/sources` runs it with a robot of its own";
const RECORDER: &str = "takes a minute; `tests/commands/recordings.rs` records a robot";

pub(super) enum Step {
    Line(&'static str, Trial),
    /// What the document tells its reader to do, or takes for granted.
    ByHand(fn(&mut Session)),
}

pub(super) struct Entry {
    pub(super) path: &'static str,
    /// The Python package that its programs need, and a module of it.
    pub(super) python: Option<(&'static str, &'static str)>,
    /// The other programs that its lines need.
    pub(super) programs: &'static [&'static str],
    pub(super) steps: &'static [Step],
}

const MCAP: Option<(&str, &str)> = Some(("mcap-ros2-support==0.5.7", "mcap.writer"));

/// The documents with command lines. Those that take longest are first.
pub(super) const ENTRIES: &[Entry] = &[
    Entry {
        path: "docs/tutorials/researcher.md",
        python: None,
        programs: &["python3"],
        steps: &[
            Line("leo study", NotRun(MINUTES)),
            Line("leo study --sweep 20", NotRun(MINUTES)),
            Line(
                "leo run --lesson config/lessons/the_button.toml --for 15",
                Interrupted("knows  the teacher is mistaken about the red square: filled"),
            ),
            Line("leo teach config/lessons/task3.toml", Ends),
            Line("leo teach config/lessons/task3.toml --perspective robot", Ends),
            Line("cp config/lessons/task1.toml my.toml", Ends),
            Line(r#"sed -i '/name = "wall"/d' my.toml"#, Ends),
            Line("leo teach my.toml", Ends),
            Line("cp -r config narrow", Ends),
            Line(
                "sed -i 's/^cone_half_angle_deg = 60.0/cone_half_angle_deg = 20.0/' narrow/perspective.toml",
                Ends,
            ),
            ByHand(by_hand::expect_narrow_cone),
            Line("leo teach config/lessons/task1.toml --config narrow/leo.toml", Ends),
            Line("leo learn config/examples/squares.jsonl", Says("all but blue")),
            Line("leo learn config/examples/squares.jsonl --language extended --noise 0.05", Ends),
            Line("leo teach config/lessons/task1.toml --json > task1.json", Ends),
            Line("leo learn config/examples/squares.jsonl --json > squares.json", Ends),
            Line("leo run", Interrupted("I learned task 1")),
            Line("leo tasks export > learned.json", Ends),
            Line("leo believe config/traces/moved.jsonl --json > beliefs.jsonl", Ends),
            Line("python3 lamp.py beliefs.jsonl", Says("3.6,0,1.0\n4.4,1,1.0\n")),
            Line("leo teach config/lessons/task1.toml --record task1.mcap", Ends),
            Line("leo replay task1.mcap", Says("frames equal")),
        ],
    },
    Entry {
        path: "docs/tutorials/robot_engineer.md",
        python: None,
        programs: &[],
        steps: &[
            Line("leo check --seconds 0", Says("65 joints")),
            Line("cp -r config bench", Ends),
            Line(
                r#"sed -i '/^name = "neck_/,/^bus/ s/^bus = .*/bus = "bench_neck"/' bench/motor.toml"#,
                Ends,
            ),
            Line(
                r#"sed -i '/^name = "left_eye_/,/^bus/ s/^bus = .*/bus = "bench_eye"/' bench/motor.toml"#,
                Ends,
            ),
            ByHand(by_hand::add_buses),
            Line("leo check --config bench/leo.toml --seconds 0", Says("65 joints")),
            Line("leo mock-bus --config bench/leo.toml", Stays("bus-bench_eye  4000000 baud")),
            ByHand(by_hand::name_mock_bus),
            Line("NECK=/tmp/leo-mock-bus-XXXXXX/bus-bench_neck", Ends),
            Line("EYE=/tmp/leo-mock-bus-XXXXXX/bus-bench_eye", Ends),
            Line("leo bus --config bench/leo.toml --bus bench_neck --device $NECK scan", Says("3 servos")),
            Line(
                "leo bus --config bench/leo.toml --bus bench_neck --device $NECK read neck_yaw_joint present_position",
                Says("180.000 deg"),
            ),
            Line(
                "leo bus --config bench/leo.toml --bus bench_neck --device $NECK torque on neck_yaw_joint",
                Ends,
            ),
            Line(
                "leo bus --config bench/leo.toml --bus bench_neck --device $NECK write neck_yaw_joint goal_position 10deg",
                Says("neck_yaw_joint is at "),
            ),
            Line("leo bus --config bench/leo.toml --bus bench_neck --device $NECK torque off", Ends),
            Line(
                "leo bus --config bench/leo.toml --bus bench_neck --device $NECK commission --yes",
                Says("8 passed, 0 failed, 0 skipped"),
            ),
            ByHand(by_hand::name_devices),
            Line(
                "leo run --config bench/leo.toml --domain /dev/shm/leo-bench --stay",
                Stays("65 joints are disarmed"),
            ),
            Line("leo top --domain /dev/shm/leo-bench", Says("joints 65")),
            Line("leo arm --domain /dev/shm/leo-bench", Says("all 65 joints are armed")),
            Line(
                "leo emergency-stop --domain /dev/shm/leo-bench",
                Says("all 65 servos say that their torque is off"),
            ),
            Line("leo emergency-stop --release --domain /dev/shm/leo-bench", Says("released")),
            Line("leo arm --domain /dev/shm/leo-bench", Says("all 65 joints are armed")),
            Line("leo bus --device /dev/ttyUSB0 --baud 57600 scan", NotRun(SERVOS)),
            Line("leo bus --device /dev/ttyUSB0 --baud 57600 set-id --id 1 --to 4", NotRun(SERVOS)),
            Line("leo bus --device /dev/ttyUSB0 --baud 57600 set-baud --id 4 --to 4000000", NotRun(SERVOS)),
            Line("leo bus --config bench/leo.toml --bus bench_neck commission", NotRun(SERVOS)),
            Line("leo bus --config bench/leo.toml --bus bench_eye commission", NotRun(SERVOS)),
        ],
    },
    Entry {
        path: "docs/tutorials/source_writer.md",
        python: Some(("iceoryx2==0.10.0", "iceoryx2")),
        programs: &["python3", "gcc"],
        steps: &[
            Line("python3 write_trace.py > lamp.jsonl", Ends),
            Line("leo believe lamp.jsonl", Says("[   3.00 s] the teacher 1 agrees with Leo's 1\n")),
            Line(
                r#"sed 's/"colour"/"colours"/' lamp.jsonl | leo believe -"#,
                Fails("did you mean `colour`?"),
            ),
            Line("cp -r config played && cp lamp.jsonl played/traces/", Ends),
            ByHand(by_hand::play_the_trace),
            Line(
                "leo run --config played/leo.toml --for 6",
                Says("knows  the teacher and Leo agree about the white cylinder"),
            ),
            Line("cp -r config camera", Ends),
            ByHand(by_hand::add_camera),
            Line("leo check --config camera/leo.toml --seconds 0", Says("65 joints")),
            Line(
                "leo run --config camera/leo.toml --domain /dev/shm/leo-camera --for 600",
                Stays("sends no frames"),
            ),
            Line("python3 -m venv venv && venv/bin/pip install iceoryx2==0.10.0", NotRun(NETWORK)),
            Line(
                "venv/bin/python docs/examples/python/observe.py --domain /dev/shm/leo-camera --source 1 --rate 30",
                Stays("publishes observations/1"),
            ),
            Line("leo top --domain /dev/shm/leo-camera", Says("source 1 camera")),
            Line("gcc -fsyntax-only -x c docs/examples/c/leo_messages.h", Ends),
        ],
    },
    Entry {
        path: "docs/lessons.md",
        python: None,
        programs: &[],
        steps: &[
            Line("leo --lesson my-lesson.toml", Interrupted("I can teach you to do one peg")),
            Line("leo teach my-lesson.toml", Ends),
        ],
    },
    Entry {
        path: "docs/recording.md",
        python: MCAP,
        programs: &[],
        steps: &[
            Line("leo teach config/lessons/task1.toml --record task1.mcap", Ends),
            Line("leo record morning.mcap --for 60", NotRun(RECORDER)),
            ByHand(by_hand::start_a_robot),
            Line("leo record --black-box", Says("_asked.mcap")),
            Line("leo view", Interrupted("Open Foxglove or Lichtblick")),
            Line("leo replay task1.mcap", Says("frames equal")),
            Line("python3 -m venv venv && venv/bin/pip install mcap", NotRun(NETWORK)),
            Line("venv/bin/python ids.py task1.mcap", Says(" [")),
        ],
    },
    Entry {
        path: "docs/operations.md",
        python: None,
        programs: &[],
        steps: &[
            Line("sudo apt install ./PACKAGE.deb", NotRun(ROOT)),
            Line("sudo -e /etc/leo/motor.toml", NotRun(ROOT)),
            Line("leo check --config /etc/leo/leo.toml", NotRun(INSTALLED)),
            Line("sudo systemctl enable --now leo", NotRun(ROOT)),
            Line("systemctl status leo", NotRun(INSTALLED)),
            Line(
                "leo run --set console.address=127.0.0.1:7781 --set belief.partners=2",
                Interrupted("the page is at http://127.0.0.1:7781/"),
            ),
            ByHand(by_hand::write_trace),
            Line(
                r#"leo believe trace.jsonl --set threshold=0.6 --set 'belief.names=["Ann"]'"#,
                Says("Ann believes in 2 things"),
            ),
            Line("leo emergency-stop", NotRun(EVERY_ROBOT)),
            Line("sudo -u leo leo emergency-stop --release", NotRun(ROOT)),
            Line("sudo systemctl stop leo", NotRun(ROOT)),
            Line("curl -X POST http://127.0.0.1:7780/stop", NotRun(PAGE)),
            Line("journalctl -u leo -f", NotRun(INSTALLED)),
            Line("journalctl -u leo -p warning --since today", NotRun(INSTALLED)),
            Line("journalctl -u leo -b -1", NotRun(INSTALLED)),
        ],
    },
    Entry {
        path: "docs/servo-bus.md",
        python: Some(("dynamixel-sdk==4.1.0", "dynamixel_sdk")),
        programs: &[],
        steps: &[
            Line("leo bus scan --device /dev/ttyUSB0 --baud 1000000", NotRun(SERVOS)),
            Line("leo bus read neck_yaw_joint present_position present_temperature", NotRun(SERVOS)),
            Line("leo bus write neck_yaw_joint profile_acceleration 20", NotRun(SERVOS)),
            Line("leo bus torque on neck_yaw_joint", NotRun(SERVOS)),
            Line("leo bus write neck_yaw_joint goal_position -10deg", NotRun(SERVOS)),
            Line("leo bus torque off", NotRun(SERVOS)),
            Line("leo bus commission --bus torso --device /dev/ttyUSB0", NotRun(SERVOS)),
            Line("leo bus commission --bus torso --yes", NotRun(SERVOS)),
            Line("leo bus commission --bus torso --only watchdog --only power-cut", NotRun(SERVOS)),
            Line("leo mock-bus", Interrupted("bus-torso  4000000 baud  XM430-W350 id 1-7  seed 0")),
            Line(r#"leo mock-bus --fault "drop id=5 p=0.01" --seed 7"#, Stays("bus-torso  4000000 baud")),
            ByHand(by_hand::name_mock_bus),
            Line("python3 -m venv venv && venv/bin/pip install dynamixel-sdk==4.1.0", NotRun(NETWORK)),
            Line("venv/bin/python scan.py /tmp/leo-mock-bus-XXXXXX/bus-torso", Says("1: [1020, ")),
        ],
    },
    Entry {
        path: "docs/traces.md",
        python: MCAP,
        programs: &["python3"],
        steps: &[
            Line("leo believe config/traces/moved.jsonl", Says("What is believed at the end")),
            Line(
                "python3 convert.py < detections.csv | leo believe -",
                Says("on for Leo, not on for the teacher\n\n3 frames, 9 observations\n"),
            ),
            Line("python3 -m venv venv && venv/bin/pip install mcap", NotRun(NETWORK)),
            Line("venv/bin/python to_mcap.py moved.mcap < config/traces/moved.jsonl", Ends),
            Line("leo believe moved.mcap", Says("What is believed at the end")),
            Line("leo believe config/traces/moved.jsonl --json > beliefs.jsonl", Ends),
            Line("python3 red.py", Says("beliefs are in something red")),
        ],
    },
    Entry {
        path: "docs/evaluation.md",
        python: None,
        programs: &[],
        steps: &[
            ByHand(by_hand::write_detections),
            Line(
                "leo evaluate --truth truth.jsonl trace.jsonl",
                Says("2 frames of the truth, 2 observations"),
            ),
            Line(
                "leo evaluate --truth gt.txt --detections det.txt --frame-rate 25",
                Says("1 frame of the truth"),
            ),
            Line("pip download --no-deps motmetrics==1.4.0", NotRun(NETWORK)),
            Line(
                "for sequence in TUD-Campus TUD-Stadtmitte; do\n\
                 unzip -j motmetrics-1.4.0-py3-none-any.whl motmetrics/data/$sequence/gt.txt -d $sequence\n\
                 curl -o $sequence/det.txt https://raw.githubusercontent.com/abewley/sort/master/data/train/$sequence/det/det.txt\n\
                 leo evaluate --truth $sequence/gt.txt --detections $sequence/det.txt --frame-rate 25\n\
                 done",
                NotRun(PUBLIC_DATA),
            ),
        ],
    },
    Entry {
        path: "docs/examples-format.md",
        python: None,
        programs: &[],
        steps: &[
            Line("leo learn config/examples/squares.jsonl", Says("all but blue")),
            Line(
                "leo learn my-experiment.jsonl --language extended --noise 0.05 --json",
                Says("\"language\":\"extended\""),
            ),
        ],
    },
    Entry {
        path: "docs/more_than_one_machine.md",
        python: None,
        programs: &["openssl"],
        steps: &[
            Line("package/link_keys.sh keys robot=DNS:leo.local,IP:192.0.2.7 remote=DNS:desk.local", Ends),
            Line(
                "LEO_QUIET_MACHINE=28 cargo test --release --test link -- --nocapture the_hot_path",
                NotRun(MEASURES),
            ),
        ],
    },
    Entry {
        path: "docs/sources.md",
        python: None,
        programs: &[],
        steps: &[
            Line("python3 -m venv venv && venv/bin/pip install iceoryx2==0.10.0", NotRun(NETWORK)),
            Line("venv/bin/python docs/examples/python/observe.py --source 1 --rate 30", NotRun(ONLY_ROBOT)),
        ],
    },
    Entry {
        path: "docs/page.md",
        python: None,
        programs: &[],
        steps: &[
            Line(
                r#"curl -H "Authorization: Bearer $(cut -d' ' -f2 /dev/shm/leo-robot/page)" http://127.0.0.1:7780/metrics"#,
                NotRun(PAGE),
            ),
            Line("curl -X POST http://127.0.0.1:7780/stop", NotRun(PAGE)),
            Line("XDG_STATE_HOME=$(mktemp -d) cargo run --release -- run --stay &", NotRun(BUILDS)),
            Line(
                r#"node tests/shots.mjs "http://127.0.0.1:7780/?token=…" --into ../../../docs/pictures page open"#,
                NotRun(BROWSER),
            ),
        ],
    },
    Entry {
        path: "README.md",
        python: None,
        programs: &[],
        steps: &[
            Line("cargo run --release", NotRun(BUILDS)),
            Line("cargo test", NotRun(EVERY_TEST)),
            Line("cargo install --locked --path .", NotRun(BUILDS)),
            Line("package/build.sh", NotRun(BUILDS)),
            Line("package/archive.sh", NotRun(BUILDS)),
        ],
    },
    Entry {
        path: "docs/CONTRIBUTING.md",
        python: None,
        programs: &[],
        steps: &[
            Line("INSTA_UPDATE=always cargo test -p CRATE", NotRun(EVERY_TEST)),
            Line("git diff -- '*.snap'", NotRun("needs a change of the repository")),
        ],
    },
];

/// The command lines of a document, and how each is tried.
pub(super) fn lines(entry: &Entry) -> impl Iterator<Item = (&'static str, &'static Trial)> {
    let steps: &'static [Step] = entry.steps;
    steps.iter().filter_map(|step| match step {
        Line(line, trial) => Some((*line, trial)),
        ByHand(_) => None,
    })
}
