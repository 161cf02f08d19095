use std::collections::BTreeMap;
use std::io::Write as _;

use account::Account;
use clock::{Duration, Instant};
use config::Robot;
use config::lesson::Lesson;
use message::{EventKind, Events, Process, Utterances};
use process::{Aside, Failure, Launch, Member, Progress};
use serde_json::json;
use transport::{Domain, Inlet};

use crate::cells::{Lines, tasks};
use crate::io::arming::Arming;
use crate::io::black_box::{Asker, BlackBox};
use crate::io::fares::Fares;
use crate::io::hand::Hands;
use crate::io::lessons::Shelf;
use crate::io::look::Look;
use crate::io::tape::Tape;
use crate::io::web::{Door, Patience, Serving, Web};
use crate::narrator::{Line, Narrator, Transcript};
use crate::requests::Wish;
use crate::sheet::Sheet;

/// The lesson ends this long after it is over, so that the last utterance still gets its answer.
const ANSWER: Duration = Duration::from_secs(1);
/// The same after a page was closed: it may only have been reloaded.
const REOPENED: Duration = Duration::from_secs(5);

/// Runs the process until it is stopped or the lesson is over. A lesson is over when all its sentences were said and
/// Leo has performed or declined every requested performance. In addition no page may be open, and no one may be
/// teaching interactively. Finally prints what Leo learned.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Console, &leo.buffers, &leo.console.realtime)?;
    let mut ear = Ear::open(&member, robot)?;
    let mut look = Look::open(&member, robot, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut stage = Stage::open(&member, launch, robot, lesson)?;
    let mut end = End::of(launch, lesson);
    let mut transcript = Transcript::default();
    let mut out = Aside::over(std::io::stdout(), "");
    // Written instead of the shared store if no page is served.
    let mut unseen = Sheet::default();
    member.begin(Some(leo.console.rate_hz.period()))?;
    if let Some(web) = &stage.web {
        // Never blocks and never fails: the writer drops what does not fit.
        let everywhere = if web.everywhere { ", and at every other address of this machine" } else { "" };
        let _taken = writeln!(out, "the page is at {}{everywhere}", web.url);
    }
    while let Some(now) = member.next_cycle()? {
        let mut told = ear.hear()?;
        let notes = stage.black_box.step(now, member.node(), &look.quarantined);
        told.extend(notes.iter().map(|words| ear.narrator.note(now.as_nanos(), words)));
        {
            let mut shared = stage.web.as_ref().map(|web| web.shared.sheet());
            let sheet = shared.as_deref_mut().unwrap_or(&mut unseen);
            look.look(sheet, |at_ns, words| told.push(ear.narrator.divide(at_ns, words)))?;
            told.extend(look.crowded().map(|words| ear.narrator.note(now.as_nanos(), words)));
            for line in &told {
                let t = look.seconds(line.at_ns);
                ear.lines.add(sheet, t, line);
            }
            if std::mem::take(&mut ear.has_news) {
                tasks(sheet, &ear.account);
            }
        }
        let text: String = told.iter().map(|line| transcript.text(line)).collect();
        if !text.is_empty() {
            let _taken = out.write_all(text.as_bytes());
        }
        stage.show(now, &member, &look, &ear.account);
        stage.answer(now, &look)?;
        let health = member.health();
        health.drops = ear.utterances.drops() + ear.events.drops() + stage.hands.drops();
        health.undelivered = stage.hands.undelivered();
        health.refused = stage.web.as_ref().map_or(0, Web::refused);
        member.end_cycle(Progress::More)?;
        let is_watched = stage.web.as_ref().is_some_and(|web| web.open() > 0) || look.is_by_hand();
        if end.has_come(now, &ear, look.is_played(), is_watched) {
            break;
        }
    }
    // Keep serving pages until all files are written, and keep the heartbeat of this process going meanwhile.
    let Stage { web: _web, tape, black_box, .. } = stage;
    let write_last = black_box.end();
    let (taped, kept) = member.beat_while(move || (tape.finish(), write_last()));
    if let Err(error) = taped {
        tracing::error!("the recording is not whole: {error}");
    }
    for words in kept {
        let line = ear.narrator.note(member.now().as_nanos(), &words);
        let _taken = out.write_all(transcript.text(&line).as_bytes());
    }
    let account = ear.account.of_today();
    if !account.tasks.is_empty() {
        let summary = format!("\nWhat Leo learned\n\n{}", account.to_text(&leo.belief.names));
        let _taken = out.write_all(summary.as_bytes());
    }
    out.finish();
    Ok(())
}

/// Subscribes to utterances and learner events.
struct Ear {
    utterances: Inlet<Utterances>,
    events: Inlet<Events>,
    narrator: Narrator,
    account: Account,
    lines: Lines,
    /// Number of utterances received.
    said: u32,
    /// Whether the account changed since it was last published.
    has_news: bool,
}

impl Ear {
    fn open(member: &Member, robot: &Robot) -> Result<Self, Failure> {
        Ok(Self {
            utterances: member.inlet(None)?,
            events: member.inlet(None)?,
            narrator: Narrator::new(&robot.leo.belief.names),
            account: Account::newest(),
            lines: Lines::default(),
            said: 0,
            has_news: true,
        })
    }

    fn hear(&mut self) -> Result<Vec<Line>, Failure> {
        let mut told = Vec::new();
        while let Some(frame) = self.utterances.receive()? {
            for utterance in frame.entries() {
                self.said += 1;
                told.push(self.narrator.utterance(frame.head().valid_at_ns, utterance));
            }
        }
        while let Some(frame) = self.events.receive()? {
            for event in frame.entries() {
                // The learner repeats remembered tasks whenever a further subscriber joins.
                let is_known = event.kind() == Some(EventKind::Remembered)
                    && self.account.examples(event.task.as_str()) == Some(event.examples);
                let line = self.narrator.event(frame.head().valid_at_ns, event);
                told.extend(line.filter(|_| !is_known));
                self.account.note(event);
                self.has_news = true;
            }
        }
        Ok(told)
    }
}

/// The services for the pages: the server, the acts, recordings and the black box.
struct Stage {
    web: Option<Web>,
    hands: Hands,
    shelf: Shelf,
    tape: Tape,
    black_box: BlackBox,
    arming: Arming,
    fares: Fares,
    joints: Vec<String>,
    agents: BTreeMap<u16, String>,
    cone_rad: f64,
}

impl Stage {
    fn open(member: &Member, launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<Self, Failure> {
        let first = lesson.teachers.first().map_or(1, |teacher| teacher.number);
        let web = robot.leo.console.address.get().and_then(|address| {
            let served = Web::serve(Serving {
                address,
                before: Door::read(&launch.domain, launch.state.as_deref()),
                urdf: robot.urdf.clone(),
                first,
                open: robot.leo.console.read_without_token,
                domain: launch.domain.clone(),
                moves_here: robot.leo.link.runs_here(Process::Motor),
                patience: Patience::default(),
            });
            // A missing page must not keep the robot from running.
            let failed = |error| {
                tracing::error!("cannot serve the page at {address}: {error}; the robot runs without");
            };
            served.map_err(failed).ok()
        });
        let shelf = Shelf::new(&robot.leo, launch.state.as_deref(), lesson);
        if let Some(web) = &web {
            if let Err(error) = web.door.leave(&launch.domain, launch.state.as_deref()) {
                tracing::warn!(%error, "pages may not find this robot again after a restart");
            }
            web.shared.sheet().put("lessons", &shelf.list());
        }
        let joints: Vec<String> = robot.motor.joints.iter().map(|joint| joint.name.clone()).collect();
        let names = &robot.leo.belief.names;
        let people = lesson.teachers.iter().map(|teacher| teacher.number);
        Ok(Self {
            hands: Hands::open(member)?,
            tape: Tape::new(launch, lesson, Domain::at(&launch.domain)?),
            black_box: BlackBox::open(launch, robot, lesson),
            arming: Arming::new(&launch.domain, &joints),
            fares: Fares::new(&joints, launch.state.clone()),
            agents: [0, 1].into_iter().chain(people).map(|agent| (agent, names.of(agent))).collect(),
            cone_rad: robot.perspective.sight.cone_half_angle_deg.radians(),
            web,
            shelf,
            joints,
        })
    }

    /// Publishes what changes rarely.
    fn show(&mut self, now: Instant, member: &Member, look: &Look, account: &Account) {
        let Some(web) = &self.web else { return };
        let mut sheet = web.shared.sheet();
        sheet.put("workspace", &self.shelf.workspace(look.workspace.as_ref(), self.hands.saved.as_deref()));
        self.arming.show(now, member, &mut sheet);
        if !self.fares.is_due(now) {
            return;
        }
        self.tape.show(now, &mut sheet);
        sheet.put(
            "robot",
            &json!({
                "version": env!("CARGO_PKG_VERSION"), "joints": self.joints, "agents": self.agents,
                "base": look.base(), "cone_rad": self.cone_rad, "perspectives": look.perspective_names(),
            }),
        );
        let metrics = self.fares.look(now, member, account, &mut sheet);
        drop(sheet);
        if let Some(metrics) = metrics {
            web.shared.set_metrics(metrics);
        }
    }

    /// Executes the pages' requests and answers them.
    fn answer(&mut self, now: Instant, look: &Look) -> Result<(), Failure> {
        let Some(web) = &self.web else { return Ok(()) };
        let asked = std::iter::from_fn(|| web.wishes.try_recv().ok());
        for asked in self.hands.carry(now, look.workspace.is_some(), asked)? {
            match asked.wish {
                Wish::Record(on) => self.tape.ask(on, asked.answer, asked.id),
                Wish::Arm(locks) => self.arming.ask(now, locks, asked.answer, asked.id),
                Wish::Keep => self.black_box.ask(Asker::Page(asked.answer, asked.id)),
                Wish::Act(_) => {}
            }
        }
        self.arming.step(now);
        if self.tape.step(now) {
            self.tape.show(now, &mut web.shared.sheet());
        }
        let saved = self.hands.saved.clone();
        self.hands.answer(now)?;
        if self.hands.saved != saved {
            web.shared.sheet().put("lessons", &self.shelf.list());
        }
        Ok(())
    }
}

/// Detects the end of the lesson.
struct End {
    sentences: u32,
    performances: usize,
    stays: bool,
    was_watched: bool,
    over_since: Option<Instant>,
}

impl End {
    fn of(launch: &Launch, lesson: &Lesson) -> Self {
        Self {
            // A restarted console does not know what was said before.
            sentences: if launch.incarnation == 1 { lesson.sentences() } else { 0 },
            performances: usize::try_from(lesson.performances()).unwrap_or(usize::MAX),
            stays: launch.stay,
            was_watched: false,
            over_since: None,
        }
    }

    fn has_come(&mut self, now: Instant, ear: &Ear, is_played: bool, is_watched: bool) -> bool {
        self.was_watched |= is_watched;
        let has_performed = if self.performances > 0 {
            ear.account.performances_ended() >= self.performances
        } else {
            is_played
        };
        let is_over = ear.said >= self.sentences && has_performed;
        if is_watched || self.stays || !is_over {
            self.over_since = None;
            return false;
        }
        let patience = if self.was_watched { REOPENED } else { ANSWER };
        now.since(*self.over_since.get_or_insert(now)) >= patience
    }
}
