use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::atomic::Ordering;

use account::Account;
use clock::Duration;
use config::Robot;
use config::lesson::Lesson;
use message::{Events, Process, Utterances};
use process::{Aside, Failure, Launch, Member, Progress};
use serde_json::json;
use transport::Domain;

use crate::cells::{Lines, tasks};
use crate::hand::{Hands, reply};
use crate::lessons::Shelf;
use crate::look::Look;
use crate::narrator::{Line, Narrator, Transcript};
use crate::sheet::Sheet;
use crate::top::Top;
use crate::web::{Door, Web};

/// The lesson is over when it has been so for this long: what was said last is answered meanwhile.
const ANSWER: Duration = Duration::from_secs(1);
/// How the processes fare is shown this often.
const FARES_EVERY: Duration = Duration::from_secs(1);

/// Runs the process until it is told to stop, or until all that is said in the lesson was said and Leo
/// has performed, or declined to, as often as it was asked to, and nobody has the page open. The last
/// it tells is the account of what Leo learned.
///
/// # Errors
///
/// The domain cannot be joined, the page cannot be served at its address, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Console, &leo.buffers, &leo.console.realtime)?;
    let mut utterances = member.inlet::<Utterances>(None)?;
    let mut events = member.inlet::<Events>(None)?;
    let mut look = Look::open(&member, robot, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut hands = Hands::open(&member)?;
    let mut shelf = Shelf::new(launch.state.as_deref(), lesson);
    let first = lesson.teachers.first().map_or(1, |teacher| teacher.number);
    let web = leo.console.address.get().map(|address| {
        let failed = |error| Failure::own(format!("cannot serve the page at {address}: {error}"));
        Web::serve(address, Door::read(&launch.domain), &robot.urdf, first).map_err(failed)
    });
    let web = web.transpose()?;
    if let Some(web) = &web
        && let Err(error) = web.door.leave(&launch.domain)
    {
        tracing::warn!(%error, "pages may not find this robot again after a restart of the console process");
    }
    let domain = Domain::at(&launch.domain)?;
    let mut top: Option<Top> = None;
    let narrator = Narrator::new(&leo.belief.names);
    let mut transcript = Transcript::default();
    let mut account = Account::default();
    let mut lines = Lines::default();
    let performances = usize::try_from(lesson.performances()).unwrap_or(usize::MAX);
    // A console that begins anew does not know what was said before.
    let mut unsaid = if launch.incarnation == 1 { lesson.sentences() } else { 0 };
    let mut over_since = None;
    let mut fared_at = None;
    let mut out = Aside::over(std::io::stdout());
    // Nobody looks where no page is served.
    let mut unseen = Sheet::default();
    let joints: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
    let agents: BTreeMap<u16, String> = (0..=u16::try_from(lesson.teachers.len()).unwrap_or(0).max(1))
        .map(|agent| (agent, leo.belief.names.of(agent)))
        .collect();
    let mut shown_tasks = false;
    member.begin(Some(leo.console.rate_hz.period()))?;
    if let Some(web) = &web {
        web.shared.sheet().put("lessons", &shelf.list());
        // Never waits and never fails: what nobody reads is left out.
        let _taken = writeln!(out, "the page is at {}", web.url);
    }
    while let Some(now) = member.next_cycle()? {
        let mut told: Vec<Line> = Vec::new();
        while let Some(frame) = utterances.receive()? {
            for utterance in frame.entries() {
                unsaid = unsaid.saturating_sub(1);
                told.push(narrator.utterance(frame.head().valid_at_ns, utterance));
            }
        }
        while let Some(frame) = events.receive()? {
            for event in frame.entries() {
                told.extend(narrator.event(frame.head().valid_at_ns, event));
                account.note(event);
                shown_tasks = false;
            }
        }
        let fares = fared_at.is_none_or(|then| now.since(then) >= FARES_EVERY);
        let rows = if fares && web.is_some() {
            fared_at = Some(now);
            if top.is_none() {
                top = Top::open(Some(domain.clone())).ok();
            }
            top.as_mut().map(Top::rows)
        } else {
            None
        };
        {
            let mut shared = web.as_ref().map(|web| web.shared.sheet());
            let sheet = shared.as_deref_mut().unwrap_or(&mut unseen);
            look.look(sheet, |at_ns, words| told.push(narrator.divide(at_ns, words)))?;
            for line in &told {
                let t = look.seconds(line.at_ns);
                lines.add(sheet, t, line);
            }
            if !shown_tasks {
                tasks(sheet, &account);
                shown_tasks = true;
            }
            sheet.put("workspace", &shelf.workspace(look.workspace.as_ref(), hands.saved.as_deref()));
            if fares {
                sheet.put("robot", &json!({
                    "version": env!("CARGO_PKG_VERSION"), "joints": joints, "agents": agents, "base": look.base(),
                    "cone_rad": robot.perspective.sight.cone_half_angle_deg.radians(),
                    "perspectives": look.perspective_names(),
                }));
            }
            for row in rows.iter().flatten() {
                sheet.put(&format!("process/{}", row.process), row);
            }
        }
        let text: String = told.iter().map(|line| transcript.text(line)).collect();
        if !text.is_empty() {
            let _taken = out.write_all(text.as_bytes());
        }
        if let Some(web) = &web {
            let asked = std::iter::from_fn(|| web.wishes.try_recv().ok());
            let others = hands.carry(now, look.workspace.is_some(), asked)?;
            for asked in others {
                reply(&asked.answer, asked.id, Err("recordings are made with `leo record FILE`"));
            }
            let saved = hands.saved.clone();
            hands.answer(now)?;
            if hands.saved != saved {
                web.shared.sheet().put("lessons", &shelf.list());
            }
        }
        let refused = web.as_ref().map_or(0, |web| {
            let counts = &web.shared.counts;
            counts.malformed.load(Ordering::Relaxed) + counts.refused.load(Ordering::Relaxed)
        });
        let health = member.health();
        health.drops = utterances.drops() + events.drops() + hands.drops();
        health.undelivered = hands.undelivered();
        health.refused = refused;
        member.end_cycle(Progress::More)?;
        let is_watched = web.as_ref().is_some_and(|web| web.open() > 0) || look.is_by_hand();
        let is_over = unsaid == 0 && performances > 0 && account.performances_ended() >= performances;
        if is_watched {
            over_since = None;
        } else if !launch.stay && is_over && now.since(*over_since.get_or_insert(now)) >= ANSWER {
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
