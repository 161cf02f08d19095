use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use rustix::process::geteuid;

use super::claim::{CLAIM_FILE, Claim, take_over_stale_claim};
use super::entries;
use crate::Domain;
use crate::domain::NAME;
use crate::segment::PARENT;

/// Removes the shared memory of a domain, then its files, then the claim and the directory. If this process is killed
/// meanwhile, the claim remains for the next sweep.
///
/// A raised emergency stop stays, and so does the directory: the next robot of that name must find it.
pub(super) fn wipe(domain: &Domain, claim: Claim) {
    if !claim.is_on(domain.root()) {
        return;
    }
    let prefix = domain.prefix();
    remove_shared_memory(|name| name.starts_with(&prefix));
    claim.folder().clear(&[CLAIM_FILE, Domain::EMERGENCY_STOP]);
    let _gone = claim.folder().remove(CLAIM_FILE);
    let _gone_unless_stopped = fs::remove_dir(domain.root());
    drop(claim);
}

/// Removes the domains of this user whose supervisor has died, and shared memory without a domain. Returns the names
/// of the removed domains. Raised emergency stops stay.
///
/// Domains that were never claimed are skipped, because a process may be about to claim them.
pub fn sweep_stale() -> Vec<String> {
    let mut swept = Vec::new();
    for entry in entries(Path::new(PARENT)) {
        let name = entry.file_name();
        let Some(name) = name.to_str().and_then(|name| name.strip_prefix(NAME)) else { continue };
        let Ok(domain) = Domain::named(name) else { continue };
        if let Some(claim) = take_over_stale_claim(&domain) {
            wipe(&domain, claim);
            swept.push(name.to_owned());
        }
    }
    remove_shared_memory(|name| {
        let domain = name.split_once('_').and_then(|(domain, _)| domain.strip_prefix(NAME));
        let domain = domain.and_then(|name| Domain::named(name).ok());
        domain.is_some_and(|domain| fs::symlink_metadata(domain.root()).is_err())
    });
    swept.sort();
    swept
}

fn remove_shared_memory(ours: impl Fn(&str) -> bool) {
    let user = geteuid().as_raw();
    for entry in entries(Path::new(PARENT)) {
        // Root could remove files of other users, but must not.
        let is_ours = entry.metadata().is_ok_and(|file| file.is_file() && file.uid() == user);
        if is_ours && entry.file_name().to_str().is_some_and(&ours) {
            let _gone = fs::remove_file(entry.path());
        }
    }
}
