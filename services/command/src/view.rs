//! `leo view`: serves the channels of a running robot to live viewers.

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use quantity::number::counted_with;
use transport::janitor::is_claimed;
use viewer_process::{Listener, LiveView, Origins, Totals};

use crate::failure::CommandError;
use crate::viewed_robot::ViewedRobot;
use crate::{domain, output};

/// Polling interval of the stop conditions.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Serve a running robot to live viewers, such as Foxglove and Lichtblick.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo view\n  leo view --listen 127.0.0.1:8766\n\nCtrl-C ends it. docs/recording.md says \
                  which channels viewers find."
)]
pub(crate) struct View {
    /// Where viewers connect
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8765", value_parser = address)]
    listen: SocketAddr,
    /// Also admit viewers that are web pages of this origin, such as https://viewer.example; may be repeated
    #[arg(long, value_name = "URL")]
    origin: Vec<String>,
    /// The robot, if several run
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    #[command(flatten)]
    viewed: ViewedRobot,
}

impl View {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let subject = self.viewed.subject()?;
        let domain = domain::running(self.domain.as_deref())?;
        if !is_claimed(&domain) {
            let root = domain.root().display();
            return Err(CommandError::runtime(format!(
                "{root}: no robot runs here: start one with `leo run`"
            )));
        }
        domain.check_layouts().map_err(CommandError::runtime)?;
        let stop = process::stop_flag().map_err(CommandError::runtime)?;
        let listener = Listener::bind(self.listen).map_err(CommandError::runtime)?;
        let address = listener.address();
        let origins = Origins::with(self.origin.iter().cloned());
        let view = LiveView::start(&domain, &subject, listener, origins).map_err(CommandError::runtime)?;
        if !address.ip().is_loopback() {
            tracing::warn!(
                "every computer that reaches {address} can watch the robot: there is no access control and no encryption"
            );
        }
        output::print(&format!(
            "Open Foxglove or Lichtblick, choose \"Open connection\", and enter {}\nCtrl-C ends it\n",
            url(address)
        ))?;
        while !stop.load(Ordering::Relaxed) && !view.has_ended() {
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
        let (totals, lost_frames) = view.stop().map_err(CommandError::runtime)?;
        output::print(&summary(totals, lost_frames))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The address to enter in a viewer.
fn url(address: SocketAddr) -> String {
    match address.ip() {
        // It stands for every address of this machine.
        IpAddr::V4(ip) if ip.is_unspecified() => format!("ws://ADDRESS-OF-THIS-MACHINE:{}", address.port()),
        IpAddr::V6(ip) if ip.is_unspecified() => format!("ws://ADDRESS-OF-THIS-MACHINE:{}", address.port()),
        IpAddr::V4(_) | IpAddr::V6(_) => format!("ws://{address}"),
    }
}

/// What is said at the end.
fn summary(Totals { clients, sent, dropped }: Totals, lost_frames: u64) -> String {
    let viewers = counted_with(clients, "viewer was", "viewers were");
    let messages = counted_with(sent, "message was", "messages were");
    let slow = match dropped {
        0 => "none was dropped".to_owned(),
        _ => format!("{} dropped: a viewer was too slow", counted_with(dropped, "was", "were")),
    };
    let lost = match lost_frames {
        0 => String::new(),
        _ => format!(
            "{} dropped: this machine was too slow\n",
            counted_with(lost_frames, "frame of the robot was", "frames of the robot were")
        ),
    };
    format!("{viewers} connected; {messages} sent, {slow}\n{lost}")
}

/// Parses an address. `localhost` is the IPv4 one, which every viewer tries.
fn address(text: &str) -> Result<SocketAddr, String> {
    let numbers = text.strip_prefix("localhost:").map(|port| format!("127.0.0.1:{port}"));
    let parsed = numbers.as_deref().unwrap_or(text).parse();
    parsed.map_err(|_no_address| "give an address and a port, for example 127.0.0.1:8765".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_counts_viewers_messages_and_losses() {
        let said = [(0, 0, 0, 0), (1, 1, 1, 1), (2, 300, 40, 5)]
            .map(|(clients, sent, dropped, lost)| summary(Totals { clients, sent, dropped }, lost));
        insta::assert_snapshot!(said.concat());
    }

    #[test]
    fn an_address_needs_a_port_and_may_name_this_machine() {
        assert_eq!(address("localhost:80").map(url), Ok("ws://127.0.0.1:80".to_owned()));
        assert_eq!(address("[::1]:80").map(url), Ok("ws://[::1]:80".to_owned()));
        assert_eq!(address("0.0.0.0:80").map(url), Ok("ws://ADDRESS-OF-THIS-MACHINE:80".to_owned()));
        for nonsense in ["", "8765", "127.0.0.1", "example.org:80", "localhost:", "127.0.0.1:99999"] {
            assert!(address(nonsense).is_err(), "{nonsense}");
        }
    }
}
