//! Console process: tells people what happens, one clear line per event.

mod divides;
mod narrator;
pub mod top;

use std::io::Write as _;

use account::Account;
use config::Robot;
use message::{Events, Process, Utterances};
use process::{Aside, Failure, Launch, Member, Progress};

use divides::Divides;
pub use narrator::Narrator;

/// Runs the process until it is told to stop, or until Leo has performed as often as the lesson has
/// it `performances`. The last it tells is the account of what Leo learned.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, performances: u32) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Console, &leo.buffers, &leo.console.realtime)?;
    let mut utterances = member.inlet::<Utterances>(None)?;
    let mut events = member.inlet::<Events>(None)?;
    let mut divides =
        Divides::open(&member, &robot.percepts, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut narrator = Narrator::default();
    let mut account = Account::default();
    let performances = usize::try_from(performances).unwrap_or(usize::MAX);
    let mut out = Aside::over(std::io::stdout());
    member.begin(Some(leo.console.rate_hz.period()))?;
    while member.next_cycle()?.is_some() {
        let mut lines = String::new();
        while let Some(frame) = utterances.receive()? {
            for utterance in frame.entries() {
                narrator.utterance(frame.head().valid_at_ns, utterance, &mut lines);
            }
        }
        while let Some(frame) = events.receive()? {
            for event in frame.entries() {
                narrator.event(frame.head().valid_at_ns, event, &mut lines);
                account.note(event);
            }
        }
        divides.tell(|at_ns, words| narrator.divide(at_ns, words, &mut lines))?;
        if !lines.is_empty() {
            // Never waits and never fails: what nobody reads is left out.
            let _taken = out.write_all(lines.as_bytes());
        }
        member.health().drops = utterances.drops() + events.drops();
        member.end_cycle(Progress::More)?;
        if !launch.stay && performances > 0 && account.performances_ended() >= performances {
            break;
        }
    }
    if !account.tasks.is_empty() {
        let summary = format!("\nWhat Leo learned\n\n{}", account.to_text());
        let _taken = out.write_all(summary.as_bytes());
    }
    out.finish();
    Ok(())
}
