use std::path::{Path, PathBuf};

use message::{Delivery, TopicId};
use serde::Deserialize;
use settings::number::{Hertz, Milliseconds};

use super::Rights;

/// The network link to a second machine.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// The role of this machine, if there are two.
    pub side: Side,
    /// The robot's name on the network.
    pub robot: RobotName,
    /// The processes that run on the remote machine.
    pub remote_processes: Vec<RemoteProcess>,
    /// The topics that this machine sends; empty means all.
    pub topics: Vec<String>,
    /// The endpoints on which this machine listens.
    pub listen: Vec<Endpoint>,
    /// The endpoints of the other machine to connect to.
    pub connect: Vec<Endpoint>,
    /// The CA certificate that signed both machines' certificates, a PEM file; empty for none.
    pub ca_certificate: PathBuf,
    /// This machine's certificate, a PEM file; empty for none.
    pub certificate: PathBuf,
    /// This machine's private key, a PEM file; empty for none.
    pub private_key: PathBuf,
    /// How often per second the link sends and receives.
    pub link_rate_hz: Hertz,
    /// A command older than this on arrival is discarded.
    pub max_command_age_ms: Milliseconds,
    /// Real-time rights.
    pub realtime: Rights,
}

/// The role of this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// There is no second machine.
    Off,
    /// The robot's machine.
    Robot,
    /// The remote machine.
    Remote,
}

/// A process that may run on the remote machine. All others belong to the hot path, or the hot path waits for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RemoteProcess {
    /// The learner.
    Learner,
    /// The console.
    Console,
}

/// The name of a robot on the network: letters, digits and hyphens.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct RobotName(String);

impl TryFrom<String> for RobotName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let legal = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
        if name.is_empty() || name.len() > 32 || !name.chars().all(legal) {
            return Err(format!("{name:?} cannot name a robot: use up to 32 letters, digits and hyphens"));
        }
        Ok(Self(name))
    }
}

impl RobotName {
    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// An endpoint `quic/HOST:PORT` (QUIC, which is TLS 1.3 over UDP: RFC 9000, RFC 9001).
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Endpoint(String);

impl TryFrom<String> for Endpoint {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no endpoint, as in \"quic/leo.local:7447\"");
        let address = text.strip_prefix("quic/").ok_or_else(wrong)?;
        let (host, port) = address.rsplit_once(':').ok_or_else(wrong)?;
        let legal = |letter: char| letter.is_ascii_alphanumeric() || "-._:[]".contains(letter);
        if host.is_empty() || !host.chars().all(legal) || port.parse::<u16>().is_err() {
            return Err(wrong());
        }
        Ok(Self(text))
    }
}

/// A host without the brackets of an IPv6 address.
fn bare(host: &str) -> &str {
    host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host)
}

impl Endpoint {
    /// As written in the file.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The host name or address, and the port: `leo.local:7447`, `[::1]:7447`.
    #[must_use]
    pub fn host_and_port(&self) -> &str {
        self.0.split_once('/').map_or("", |(_, address)| address)
    }

    /// The host name or address alone: `leo.local`, `::1`.
    #[must_use]
    pub fn host(&self) -> &str {
        bare(self.host_and_port().rsplit_once(':').map_or("", |(host, _)| host))
    }
}

impl Link {
    /// Whether a process runs on the remote machine.
    #[must_use]
    pub fn is_remote(&self, process: message::Process) -> bool {
        self.remote_processes.iter().any(|remote| remote.process() == process)
    }

    /// Whether a process runs on this machine. With two machines, each process runs on one of them, and the link on
    /// both.
    #[must_use]
    pub fn runs_here(&self, process: message::Process) -> bool {
        match self.side {
            Side::Off => process != message::Process::Link,
            Side::Robot => !self.is_remote(process),
            Side::Remote => self.is_remote(process) || process == message::Process::Link,
        }
    }

    /// Resolves relative paths against the folder of `leo.toml`.
    pub(crate) fn relative_to(&mut self, folder: &Path) {
        for file in [&mut self.ca_certificate, &mut self.certificate, &mut self.private_key] {
            if !file.as_os_str().is_empty() {
                *file = folder.join(&file);
            }
        }
    }
}

impl RemoteProcess {
    const fn process(self) -> message::Process {
        match self {
            Self::Learner => message::Process::Learner,
            Self::Console => message::Process::Console,
        }
    }
}

/// The first error in the link as a whole: the key and the reason.
pub(crate) fn fault(link: &Link) -> Option<(&'static str, String)> {
    let rows = TopicId::one_of_each(0).map(TopicId::row);
    let linked = rows.iter().filter(|row| row.delivery != Delivery::Local).map(|row| row.name);
    if let Some(unknown) =
        link.topics.iter().find(|name| linked.clone().all(|linked| linked != name.as_str()))
    {
        let linked: Vec<&str> = linked.collect();
        return Some((
            "topics",
            format!("{unknown:?} is not a topic that can be sent: use one of {}", linked.join(", ")),
        ));
    }
    if link.side == Side::Off {
        return None;
    }
    if link.listen.is_empty() && link.connect.is_empty() {
        return Some(("listen", "the link is on, and needs `listen` or `connect`".to_owned()));
    }
    let keys = [&link.ca_certificate, &link.certificate, &link.private_key];
    if keys.iter().any(|file| file.as_os_str().is_empty()) {
        let reason = "the link is on, and needs `ca_certificate`, `certificate` and `private_key`; \
                      docs/more_than_one_machine.md says how to make them";
        return Some(("ca_certificate", reason.to_owned()));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn endpoint(text: &str) -> Result<Endpoint, String> {
        Endpoint::try_from(text.to_owned())
    }

    #[test]
    fn key_files_readable_by_others_are_refused() {
        for open in ["tcp/0.0.0.0:7447", "tcp/192.168.0.7:7447", "tcp/[::]:7447", "tcp/127.0.0.1:1"] {
            assert!(endpoint(open).unwrap_err().contains("is no endpoint, as in \"quic/"), "{open}");
        }
        assert!(endpoint("quic/0.0.0.0:7447").is_ok());
    }

    #[test]
    fn an_endpoint_has_a_host_and_a_port() {
        let named = endpoint("quic/leo.local:7447").unwrap();
        assert_eq!((named.host(), named.host_and_port()), ("leo.local", "leo.local:7447"));
        let six = endpoint("quic/[::1]:7447").unwrap();
        assert_eq!((six.host(), six.host_and_port()), ("::1", "[::1]:7447"));
    }

    #[test]
    fn an_invalid_endpoint_is_refused() {
        for wrong in
            ["", "quic", "quic/leo", "quic/leo:", "quic/leo:70000", "quic/:7447", "tls/leo:1", "quic/a#b:1"]
        {
            assert!(endpoint(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_robot_name_contains_no_separator_or_wildcard() {
        assert!(RobotName::try_from("leo-2".to_owned()).is_ok());
        for wrong in ["", "leo/2", "*", "leo 2"] {
            assert!(RobotName::try_from(wrong.to_owned()).is_err(), "{wrong}");
        }
    }
}
