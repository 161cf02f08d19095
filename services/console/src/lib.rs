//! Console process: tells people what happens, one clear line per event.

mod divides;
mod narrator;
pub mod top;

use std::io::Write as _;

use account::Account;
use clock::Duration;
use config::Robot;
use config::lesson::Lesson;
use message::{Events, Process, Utterances};
use process::{Aside, Failure, Launch, Member, Progress};

use divides::Divides;
pub use narrator::Narrator;

/// The lesson is over when it has been so for this long: what was said last is answered meanwhile.
const ANSWER: Duration = Duration::from_secs(1);

/// Runs the process until it is told to stop, or until all that is said in the lesson was said and Leo
/// has performed, or declined to, as often as it was asked to. The last it tells is the account of
/// what Leo learned.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Console, &leo.buffers, &leo.console.realtime)?;
    let mut utterances = member.inlet::<Utterances>(None)?;
    let mut events = member.inlet::<Events>(None)?;
    let mut divides = Divides::open(&member, robot, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut narrator = Narrator::new(&leo.belief.names);
    let mut account = Account::default();
    let performances = usize::try_from(lesson.performances()).unwrap_or(usize::MAX);
    // A console that begins anew does not know what was said before.
    let mut unsaid = if launch.incarnation == 1 { lesson.sentences() } else { 0 };
    let mut over_since = None;
    let mut out = Aside::over(std::io::stdout());
    member.begin(Some(leo.console.rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        let mut lines = String::new();
        while let Some(frame) = utterances.receive()? {
            for utterance in frame.entries() {
                unsaid = unsaid.saturating_sub(1);
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
        let is_over = unsaid == 0 && performances > 0 && account.performances_ended() >= performances;
        if !launch.stay && is_over && now.since(*over_since.get_or_insert(now)) >= ANSWER {
            break;
        }
    }
    if !account.tasks.is_empty() {
        let summary = format!("\nWhat Leo learned\n\n{}", account.to_text(&leo.belief.names));
        let _taken = out.write_all(summary.as_bytes());
    }
    out.finish();
    Ok(())
}
