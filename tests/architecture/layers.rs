//! The layers of crates: an arrow only goes down, and what is wrapped is named by one crate.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand, Package};

/// The crates from the top to the base, one row per layer. An arrow only goes down.
pub(crate) const LAYERS: [&[&str]; 9] = [
    &["leo"],
    &["commands"],
    &[
        "belief-process",
        "console-process",
        "learner-process",
        "link-process",
        "mock-bus-process",
        "motor-process",
        "sensor-process",
        "simulator-process",
        "supervisor-process",
        "viewer-process",
    ],
    &[
        "folder",
        "process",
        "reader",
        "realtime",
        "recording",
        "serial",
        "store",
        "torque",
        "trace",
        "transport",
    ],
    &["reports", "study"],
    // It composes the settings that the crates of the domain own. None of them may know it.
    &["config"],
    &[
        "leo-belief",
        "cycle",
        "leo-evaluation",
        "leo-kinematics",
        "leo-language",
        "motion",
        "persons",
        "leo-perception",
        "leo-perspective",
        "records",
        "leo-scene",
        "leo-servo",
        "leo-tasks",
    ],
    &["leo-message"],
    &[
        "budget",
        "leo-clock",
        "leo-geometry",
        "leo-invariant",
        "leo-prefetch",
        "leo-quantity",
        "leo-settings",
        "skip",
        "testkit",
    ],
];

/// Arrows within a layer, from the crate to those of its own layer that it may know.
const PEERS: [(&str, &[&str]); 11] = [
    ("process", &["folder", "realtime", "transport"]),
    ("reader", &["transport"]),
    ("store", &["folder"]),
    ("transport", &["folder"]),
    ("recording", &["folder", "transport"]),
    ("torque", &["serial"]),
    ("leo-belief", &["leo-perception"]),
    ("leo-perspective", &["leo-belief", "leo-perception", "leo-scene"]),
    ("motion", &["leo-kinematics"]),
    ("study", &["reports"]),
    ("testkit", &["leo-clock"]),
];

/// What others made that only some of our crates may know.
const WRAPPED: [(&str, &[&str]); 22] = [
    ("iceoryx2", &["transport"]),
    ("iceoryx2-bb-derive-macros", &["leo-message"]),
    ("iceoryx2-bb-elementary-traits", &["leo-message"]),
    ("clap_complete", &["commands"]),
    ("clap_mangen", &["commands"]),
    ("parry3d", &["leo-scene"]),
    ("pathfinding", &["leo-evaluation"]),
    ("pest", &["leo-language"]),
    ("pest_meta", &["leo-language"]),
    ("pest_vm", &["leo-language"]),
    ("ratatui", &["console-process"]),
    ("mcap", &["recording", "records", "trace"]),
    ("libc", &["realtime"]),
    ("signal-hook", &["process", "supervisor-process"]),
    (
        "rustix",
        &[
            "leo-clock",
            "folder",
            "process",
            "realtime",
            "recording",
            "serial",
            "supervisor-process",
            "testkit",
            "transport",
        ],
    ),
    ("quick-xml", &["leo-kinematics"]),
    ("toml", &["config", "leo-settings"]),
    ("quinn", &["link-process"]),
    ("quinn-proto", &["link-process"]),
    ("rustls", &["link-process"]),
    ("futures-util", &["viewer-process"]),
    ("tokio-tungstenite", &["viewer-process"]),
];

/// The packages of the workspace.
pub(crate) fn packages() -> Vec<Package> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).no_deps().exec().expect("cargo metadata").packages
}

/// Dependencies of each crate, those of its tests aside, by name.
pub(crate) fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let of = |package: &Package| {
        let kept = package.dependencies.iter().filter(|dependency| dependency.kind == DependencyKind::Normal);
        kept.map(|dependency| dependency.name.clone()).collect()
    };
    packages().iter().map(|package| (package.name.to_string(), of(package))).collect()
}

fn layer_of(name: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&name))
}

#[test]
fn crate_dependencies_only_go_down() {
    let dependencies = dependencies();
    let mut wrong = Vec::new();
    let mut edges = 0;
    for (from, to) in &dependencies {
        let Some(layer) = layer_of(from) else {
            wrong.push(format!("`{from}` is in no layer: list it in LAYERS"));
            continue;
        };
        let peers = PEERS.iter().find(|(name, _)| name == from).map_or(&[][..], |(_, peers)| peers);
        for name in to.iter().filter(|name| dependencies.contains_key(*name)) {
            edges += 1;
            let goes_down = layer_of(name).is_some_and(|below| below > layer);
            if !goes_down && !peers.contains(&name.as_str()) {
                wrong.push(format!("`{from}` may not know `{name}`"));
            }
        }
        wrong.extend(
            peers
                .iter()
                .filter(|peer| !to.contains(**peer))
                .map(|peer| format!("`{from}` no longer knows `{peer}`")),
        );
    }
    let listed: usize = LAYERS.iter().map(|layer| layer.len()).sum();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(listed, dependencies.len(), "LAYERS lists a crate that is gone");
    assert!(edges > 50, "only {edges} edges were seen");
}

#[test]
fn wrapped_dependencies_are_used_only_by_their_wrappers() {
    let dependencies = dependencies();
    for (foreign, may) in WRAPPED {
        let knows: Vec<&str> = dependencies
            .iter()
            .filter(|(_, to)| to.contains(foreign))
            .map(|(from, _)| from.as_str())
            .collect();
        let wrong: Vec<&&str> = knows.iter().filter(|name| !may.contains(name)).collect();
        assert!(wrong.is_empty(), "{wrong:?} may not know `{foreign}`: only {may:?} may");
        assert!(!knows.is_empty(), "nobody knows `{foreign}`: take it out of WRAPPED");
    }
}
