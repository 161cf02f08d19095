use std::fs;
use std::path::Path;

use message::{
    EventKind, FeatureKind, FeatureUnit, Hop, JointArming, JointCause, JointLink, JointMode, JointMotion,
    JointPower, Loss, Modality, ObservationKind, PerceptKernel, PerceptRole, Process, ProcessState,
    SceneMode, State, TeacherActKind, ThingRole, TurnKind,
};

/// A `wire_enum!` type: its name and values.
pub(crate) struct Numbered {
    pub(crate) name: String,
    pub(crate) doc: Vec<String>,
    pub(crate) values: Vec<Value>,
}

/// A value of a `wire_enum!` type.
pub(crate) struct Value {
    pub(crate) name: String,
    pub(crate) number: u32,
    pub(crate) doc: String,
}

/// The compiler's values of every `wire_enum!` type.
fn compiled() -> Vec<(&'static str, Vec<(String, u32)>)> {
    macro_rules! compiled {
        ($($name:ident)+) => {
            vec![$((
                stringify!($name),
                $name::ALL.iter().map(|value| (format!("{value:?}"), u32::from(value.raw()))).collect(),
            )),+]
        };
    }
    compiled!(
        EventKind FeatureKind FeatureUnit Hop JointArming JointCause JointLink JointMode JointMotion JointPower Loss Modality
        ObservationKind PerceptKernel PerceptRole Process ProcessState SceneMode State TeacherActKind ThingRole TurnKind
    )
}

/// All `wire_enum!` types of the crate, sorted by name.
pub(crate) fn numbers() -> Vec<Numbered> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the crate has sources") {
        let source = fs::read_to_string(entry.expect("readable").path()).expect("sources are text");
        let mut lines = source.lines();
        while lines.by_ref().any(|line| line == "wire_enum! {") {
            found.push(numbered(lines.by_ref().take_while(|line| *line != "}")));
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    let values = |numbered: &Numbered| {
        numbered.values.iter().map(|value| (value.name.clone(), value.number)).collect::<Vec<_>>()
    };
    let read: Vec<_> = found.iter().map(|numbered| (numbered.name.as_str(), values(numbered))).collect();
    assert_eq!(read, compiled(), "a `wire_enum!` type is not listed here, or was read wrongly");
    found
}

fn numbered<'a>(body: impl Iterator<Item = &'a str>) -> Numbered {
    let mut numbered = Numbered { name: String::new(), doc: Vec::new(), values: Vec::new() };
    let mut doc: Vec<String> = Vec::new();
    for line in body.map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            doc.push(text.trim().to_owned());
        } else if let Some((name, _)) = line.split_once(": ").filter(|_| line.ends_with('{')) {
            name.clone_into(&mut numbered.name);
            numbered.doc = std::mem::take(&mut doc);
        } else if let Some((name, number)) = line.trim_end_matches(',').split_once(" = ") {
            // A name may follow the number.
            let number = number.split(' ').next().unwrap_or(number).parse().expect("a number");
            let doc = std::mem::take(&mut doc).join(" ");
            numbered.values.push(Value { name: name.to_owned(), number, doc });
        }
    }
    numbered
}
