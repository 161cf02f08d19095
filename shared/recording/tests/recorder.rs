//! Recording a domain that cannot be joined.

use std::fs;
use std::path::Path;

use clock::Duration;
use folder::{Existing, Output};
use geometry::Pose;
use recording::{RecordError, Recorder, Subject, Time};
use transport::Domain;

#[test]
fn an_unjoinable_domain_is_an_immediate_error() {
    let domain = Domain::named(&format!("recorder-{}", std::process::id())).unwrap();
    domain.make().unwrap();
    fs::write(domain.root().join("iceoryx2.toml"), "this is no configuration").unwrap();
    let subject = || Subject::load(None, Time::Wall, None, Pose::identity(), "a test").unwrap();
    let file = domain.root().join("x.mcap");
    let output = |file: &Path| Output::named(file, Existing::Keep);
    let kept = Recorder::keep(&domain, subject(), Duration::from_secs(1), usize::MAX).map(drop);
    let started = Recorder::start(&domain, subject(), &output(&file)).map(drop);
    let nowhere = Recorder::start(&domain, subject(), &output(&file.join("y"))).map(drop);
    let is_left = file.exists();
    fs::remove_dir_all(domain.root()).unwrap();
    assert!(matches!(kept, Err(RecordError::Join(_))), "{kept:?}");
    assert!(matches!(started, Err(RecordError::Join(_))) && !is_left, "{started:?}");
    assert!(matches!(nowhere, Err(RecordError::Create { .. })), "{nowhere:?}");
}
