//! A claim that fails leaves nothing in shared memory. The only test of its process, whose descriptors it uses up.

use std::fs::File;

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use transport::Domain;
use transport::janitor::{ClaimError, claim};

#[test]
fn a_claim_without_descriptors_left_leaves_no_directory() {
    let domain = Domain::named(&format!("claim-{}", std::process::id())).expect("a name");
    let before = getrlimit(Resource::Nofile);
    let mut refused = 0_u32;
    // Each turn leaves room for one descriptor more than the last, until the claim succeeds.
    let next = u64::try_from(std::os::fd::AsRawFd::as_raw_fd(&File::open("/").expect("opens")))
        .expect("is positive");
    let claimed = (next..next + 10).find_map(|limit| {
        setrlimit(Resource::Nofile, Rlimit { current: Some(limit), ..before }).expect("may be lowered");
        match claim(&domain) {
            Ok(claim) => Some(claim),
            Err(ClaimError::Failed { .. }) => {
                refused += 1;
                assert!(!domain.root().exists(), "{} with {limit} descriptors", domain.root().display());
                None
            }
            Err(error) => panic!("{error}"),
        }
    });
    setrlimit(Resource::Nofile, before).expect("may be raised again");
    assert!(refused >= 2, "the directory and the claim file need a descriptor each: {refused}");
    let claimed = claimed.expect("ten descriptors suffice");
    transport::janitor::Janitor::new(&domain).wipe(claimed);
    assert!(!domain.root().exists());
}
