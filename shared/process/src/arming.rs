//! Arming: a person's order that joints may move. It is a file in the domain's folder, which the motor process takes
//! away as it obeys: an order is carried out once, and none outlives the robot.

use std::fs;
use std::io;
use std::path::Path;

use transport::Domain;

/// What a person orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmOrder {
    /// Which locks they acknowledge: those up to this one, by [`message::Joints::locks`] as they saw it. Without,
    /// joints that are locked stay locked, and the others are armed.
    pub acknowledged_locks: Option<u64>,
}

/// Orders the motor process of the robot in a domain's folder to arm its joints. Nothing says that it has: that
/// stands on the board of the joints.
///
/// # Errors
///
/// There is no such robot, or this user may not write in its folder.
pub fn order(domain: &Path, order: ArmOrder) -> io::Result<()> {
    // Whoever sees the file sees all of it.
    let draft = domain.join(format!("arm.{}", std::process::id()));
    let acknowledged = order.acknowledged_locks.map_or_else(String::new, |locks| locks.to_string());
    let written = fs::write(&draft, format!("acknowledged_locks = {acknowledged}\n"))
        .and_then(|()| fs::rename(&draft, Domain::arm_order(domain)));
    if written.is_err() {
        let _gone = fs::remove_file(&draft);
    }
    written
}

/// Takes the order that stands, if any: it is carried out once. A file that holds no order is taken away, and is none.
///
/// # Errors
///
/// The file cannot be read, or cannot be taken away: then it is not obeyed either.
pub fn take(domain: &Path) -> io::Result<Option<ArmOrder>> {
    let file = Domain::arm_order(domain);
    let text = match fs::read_to_string(&file) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    fs::remove_file(&file)?;
    Ok(parse(&text))
}

fn parse(text: &str) -> Option<ArmOrder> {
    let locks = text.trim().strip_prefix("acknowledged_locks =")?.trim();
    let acknowledged_locks = if locks.is_empty() { None } else { Some(locks.parse().ok()?) };
    Some(ArmOrder { acknowledged_locks })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_taken_once_and_what_is_none_is_taken_away() {
        let domain = tempfile::tempdir().unwrap();
        let domain = domain.path();
        assert_eq!(take(domain).unwrap(), None);
        for acknowledged_locks in [None, Some(0), Some(u64::MAX)] {
            order(domain, ArmOrder { acknowledged_locks: Some(7) }).unwrap();
            order(domain, ArmOrder { acknowledged_locks }).unwrap();
            assert_eq!(take(domain).unwrap(), Some(ArmOrder { acknowledged_locks }), "the newest stands");
            assert_eq!(take(domain).unwrap(), None);
        }
        for nonsense in
            ["", "arm", "acknowledged_locks = -1", "acknowledged_locks = 1 2", "acknowledged_locks"]
        {
            fs::write(Domain::arm_order(domain), nonsense).unwrap();
            assert_eq!(take(domain).unwrap(), None, "{nonsense}");
        }
        assert_eq!(fs::read_dir(domain).unwrap().count(), 0);
        assert!(order(&domain.join("gone"), ArmOrder { acknowledged_locks: None }).is_err());
    }
}
