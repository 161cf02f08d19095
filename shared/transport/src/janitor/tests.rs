use folder::FolderError;

use super::*;
use crate::DomainError;
use std::fs::File;

/// A claimed domain for one test, removed when the test ends.
struct Place {
    domain: Domain,
    claim: Option<Claim>,
}

impl Place {
    fn new(name: &str) -> Self {
        let domain = Domain::named(&format!("janitor-{name}-{}", std::process::id())).unwrap();
        let claim = claim(&domain).unwrap();
        fs::create_dir_all(domain.root().join(NODES)).unwrap();
        fs::create_dir_all(domain.root().join(SERVICES)).unwrap();
        Self { domain, claim: Some(claim) }
    }

    fn shared(&self, name: &str) -> PathBuf {
        Path::new(PARENT).join(format!("{}{name}", self.domain.prefix()))
    }

    fn below(&self, name: &str) -> PathBuf {
        self.domain.root().join(name)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _released = fs::remove_file(Domain::emergency_stop(self.domain.root()));
        if let Some(claim) = self.claim.take() {
            Janitor::new(&self.domain).wipe(claim);
        }
    }
}

fn file(path: &Path, bytes: &[u8], mode: u32) {
    fs::write(path, bytes).unwrap();
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

const LATER: Instant = Instant::from_nanos(200_000_000);

#[test]
fn a_middleware_file_that_stays_incomplete_is_repaired() {
    let place = Place::new("mend");
    file(&place.shared("a.connection"), b"", 0o600);
    file(&place.below("services/b.service"), b"{", UNFINISHED);
    fs::create_dir(place.below("nodes/7")).unwrap();
    file(&place.below(&format!("nodes/{}7.node_monitor", place.domain.prefix())), b"", 0o600);
    file(&place.below("nodes/7/c.port_tag"), b"", UNFINISHED);
    fs::create_dir(place.below("nodes/8")).unwrap();
    file(&place.below("nodes/8/d.details"), b"", 0o400);

    let mut janitor = Janitor::new(&place.domain);
    assert_eq!(janitor.scan(Instant::EPOCH), ScanResult { repaired: 0, suspects: 4 });
    assert_eq!(janitor.scan(LATER - Duration::from_nanos(1)), ScanResult { repaired: 0, suspects: 4 });
    assert_eq!(janitor.scan(LATER), ScanResult { repaired: 4, suspects: 0 });

    assert!(!place.shared("a.connection").exists());
    assert!(!place.below("services/b.service").exists());
    assert!(!place.below("nodes/8").exists());
    let tag = fs::metadata(place.below("nodes/7/c.port_tag")).unwrap();
    assert_eq!(permissions(tag.mode()), FINISHED);
    assert_eq!(janitor.scan(LATER), ScanResult::default());
}

#[test]
fn whole_files_are_left_alone() {
    let place = Place::new("whole");
    let whole = [
        place.shared("a.connection"),
        place.below("services/b.service"),
        place.below("nodes/x.node_monitor"),
    ];
    for path in &whole {
        file(path, b"whole", FINISHED);
    }
    let mut janitor = Janitor::new(&place.domain);
    assert_eq!(janitor.scan(Instant::EPOCH), ScanResult::default());
    assert_eq!(janitor.scan(LATER), ScanResult::default());
    assert!(whole.iter().all(|path| path.exists()));
}

#[test]
fn a_completed_or_recreated_file_is_no_longer_suspected() {
    let place = Place::new("anew");
    let path = place.shared("a.data");
    file(&path, b"", 0o600);
    let mut janitor = Janitor::new(&place.domain);
    assert_eq!(janitor.scan(Instant::EPOCH).suspects, 1);
    // Created before the old file is removed, so that it gets another inode.
    let other = place.shared("b.data");
    file(&other, b"", 0o600);
    fs::rename(&other, &path).unwrap();
    assert_eq!(janitor.scan(LATER), ScanResult { repaired: 0, suspects: 1 });
    assert!(path.exists());
}

#[test]
fn a_domain_is_claimed_once_until_its_holder_is_gone() {
    let mut place = Place::new("claim");
    let refused = claim(&place.domain).unwrap_err();
    assert!(matches!(refused, ClaimError::Held { .. }), "{refused}");
    drop(place.claim.take());
    place.claim = Some(claim(&place.domain).unwrap());
}

#[test]
fn a_domain_claimed_during_a_wipe_has_one_holder() {
    let domain = Domain::named(&format!("janitor-contended-{}", std::process::id())).unwrap();
    let claimed = std::thread::scope(|scope| {
        let claimers = [0, 1].map(|_| {
            scope.spawn(|| {
                let mut claimed = 0;
                for _ in 0..2000 {
                    match claim(&domain) {
                        Ok(claim) => {
                            Janitor::new(&domain).wipe(claim);
                            claimed += 1;
                        }
                        Err(ClaimError::Held { .. }) => {}
                        Err(error) => panic!("{error}"),
                    }
                }
                claimed
            })
        });
        claimers.map(|claimer| claimer.join().unwrap())
    });
    assert!(claimed.iter().sum::<u32>() > 0, "{claimed:?}");
    assert!(!domain.root().exists());
}

#[test]
fn a_sweep_removes_only_domains_without_a_holder() {
    let living = Place::new("living");
    file(&living.shared("a.data"), b"whole", 0o600);
    let mut dead = Place::new("dead");
    file(&dead.shared("a.data"), b"whole", 0o600);
    file(&dead.below("nodes/x.node_monitor"), b"", 0o600);
    drop(dead.claim.take());
    let orphan = dead.domain.root().with_file_name(format!("leo-orphan{}_a.data", std::process::id()));
    File::create(&orphan).unwrap();

    let swept = sweep_stale();
    assert!(swept.contains(&format!("janitor-dead-{}", std::process::id())), "{swept:?}");
    assert!(!dead.domain.root().exists() && !dead.shared("a.data").exists() && !orphan.exists());
    assert!(living.domain.root().exists() && living.shared("a.data").exists());
}

#[test]
fn a_wipe_removes_every_file() {
    let mut place = Place::new("wipe");
    file(&place.shared("a.data"), b"whole", 0o600);
    file(&place.below("services/b.service"), b"{}", 0o400);
    let claim = place.claim.take().unwrap();
    Janitor::new(&place.domain).wipe(claim);
    assert!(!place.domain.root().exists() && !place.shared("a.data").exists());
}

#[test]
fn only_an_emergency_stop_survives_a_wipe_and_a_sweep() {
    for ends_in_order in [true, false] {
        let mut place = Place::new("stopped");
        let stop = Domain::emergency_stop(place.domain.root());
        file(&stop, b"a hand is in the arm\n", 0o600);
        file(&place.shared("a.data"), b"whole", 0o600);
        let claim = place.claim.take().unwrap();
        if ends_in_order {
            Janitor::new(&place.domain).wipe(claim);
        } else {
            drop(claim);
            sweep_stale();
        }
        assert_eq!(fs::read(&stop).unwrap(), b"a hand is in the arm\n");
        let left: Vec<PathBuf> = entries(place.domain.root()).map(|entry| entry.path()).collect();
        assert!(left == [stop.clone()] && !place.shared("a.data").exists(), "{left:?}");
        assert!(Domain::all().contains(&place.domain) && !is_claimed(&place.domain));
        assert!(sweep_stale().iter().all(|name| !name.starts_with("janitor-stopped")), "it is no leftover");
        place.claim = Some(super::claim(&place.domain).unwrap());
        assert!(stop.exists());
    }
}

#[test]
fn a_link_in_the_place_of_a_domain_is_refused() {
    let precious = tempfile::tempdir().unwrap();
    fs::write(precious.path().join("learned"), "all").unwrap();
    fs::write(precious.path().join(claim::CLAIM_FILE), "").unwrap();
    let domain = Domain::named(&format!("janitor-link-{}", std::process::id())).unwrap();
    std::os::unix::fs::symlink(precious.path(), domain.root()).unwrap();
    let claimed = claim(&domain).unwrap_err();
    let made = domain.make().unwrap_err();
    let found = Domain::at(domain.root()).unwrap_err();
    let swept = sweep_stale();
    fs::remove_file(domain.root()).unwrap();
    assert!(matches!(claimed, ClaimError::Folder(FolderError::Link { .. })), "{claimed:?}");
    assert!(matches!(made, DomainError::Folder(FolderError::Link { .. })), "{made:?}");
    assert!(matches!(found, DomainError::Folder(FolderError::Link { .. })), "{found:?}");
    assert!(!swept.iter().any(|name| name.starts_with("janitor-link")), "{swept:?}");
    let left: Vec<_> = entries(precious.path()).map(|entry| entry.file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn a_domain_that_others_may_write_is_refused() {
    let domain = Domain::named(&format!("janitor-open-{}", std::process::id())).unwrap();
    fs::create_dir(domain.root()).unwrap();
    fs::set_permissions(domain.root(), Permissions::from_mode(0o777)).unwrap();
    let claimed = claim(&domain).unwrap_err();
    fs::remove_dir(domain.root()).unwrap();
    assert!(
        matches!(claimed, ClaimError::Folder(FolderError::WritableByOthers { mode: 0o777, .. })),
        "{claimed:?}"
    );
}

#[test]
fn claim_error_messages_match_the_snapshot() {
    let root = || PathBuf::from("/dev/shm/leo-a");
    let errors = [
        ClaimError::Held { root: root() },
        ClaimError::OfAnother { root: root(), owner: 1001 },
        ClaimError::Folder(FolderError::NoFolder { path: root() }),
        ClaimError::Failed { path: root().join("claim"), source: std::io::ErrorKind::StorageFull.into() },
    ];
    insta::assert_snapshot!(errors.map(|error| error.to_string()).join("\n"));
}
