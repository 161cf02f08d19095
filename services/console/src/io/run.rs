use std::collections::BTreeMap;
use std::io::Write as _;

use clock::{Duration, Instant};
use config::Robot;
use config::lesson::Lesson;
use message::{EventKind, Events, Process, Utterances};
use process::{Launch, NonBlockingWriter, ProcessError, ProcessNode, Progress};
use reports::lesson::LessonReport;
use serde_json::json;
use transport::{Domain, FrameSubscriber};

use crate::cells::{Lines, tasks};
use crate::io::arming::Arming;
use crate::io::black_box::{BlackBox, Requester};
use crate::io::hand::PendingActs;
use crate::io::lessons::LessonLibrary;
use crate::io::look::TopicPoller;
use crate::io::metrics_poller::MetricsPoller;
use crate::io::tape::Tape;
use crate::io::web::{ServerIdentity, Serving, Timeouts, Web};
use crate::narrator::{Line, Narrator, Transcript};
use crate::requests::PageRequest;
use crate::state_store::StateStore;

/// The lesson ends this long after it is over, so that the last utterance still gets its answer.
const ANSWER_GRACE: Duration = Duration::from_secs(1);
/// The same after a page was closed: it may only have been reloaded.
const RELOAD_GRACE: Duration = Duration::from_secs(5);

/// Runs the process until it is stopped or the lesson is over. A lesson is over when all its sentences were said and
/// Leo has performed or declined every requested performance. In addition no page may be open, and no one may be
/// teaching interactively. Finally prints what Leo learned.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let mut member = ProcessNode::join(launch, Process::Console, &leo.buffers, &leo.console.realtime)?;
    let mut event_reader = EventReader::open(&member, robot)?;
    let mut look = TopicPoller::open(&member, robot, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut page_services = PageServices::open(&member, launch, robot, lesson)?;
    let mut end = End::of(launch, lesson);
    let mut transcript = Transcript::default();
    let mut out = NonBlockingWriter::over(std::io::stdout(), "");
    // Written instead of the shared store if no page is served.
    let mut unseen = StateStore::default();
    member.begin(Some(leo.console.rate_hz.period()))?;
    if let Some(web) = &page_services.web {
        // Never blocks and never fails: the writer drops what does not fit.
        let everywhere = if web.everywhere { ", and at every other address of this machine" } else { "" };
        let _taken = writeln!(out, "the page is at {}{everywhere}", web.url);
        if let Some(port) = web.port_in_use {
            let _taken = writeln!(out, "port {port} was in use, so the page has the next free one");
        }
    }
    while let Some(now) = member.next_cycle()? {
        let mut lines = event_reader.hear()?;
        let notes = page_services.black_box.step(now, member.node(), &look.quarantined);
        lines.extend(notes.iter().map(|words| event_reader.narrator.note(now.as_nanos(), words)));
        {
            let mut shared = page_services.web.as_ref().map(|web| web.shared.state_store());
            let state_store = shared.as_deref_mut().unwrap_or(&mut unseen);
            look.look(state_store, |at_ns, words| lines.push(event_reader.narrator.divide(at_ns, words)))?;
            lines.extend(look.crowded().map(|words| event_reader.narrator.note(now.as_nanos(), words)));
            for line in &lines {
                let t = look.seconds(line.at_ns);
                event_reader.lines.add(state_store, t, line);
            }
            if std::mem::take(&mut event_reader.has_news) {
                tasks(state_store, &event_reader.report);
            }
        }
        let text: String = lines.iter().map(|line| transcript.text(line)).collect();
        if !text.is_empty() {
            let _taken = out.write_all(text.as_bytes());
        }
        page_services.show(now, &member, &look, &event_reader.report);
        page_services.answer(now, &look)?;
        let health = member.health();
        health.drops = event_reader.utterances.drops()
            + event_reader.events.drops()
            + page_services.pending_acts.drops();
        health.undelivered = page_services.pending_acts.undelivered();
        health.refused = page_services.web.as_ref().map_or(0, Web::refused);
        member.end_cycle(Progress::More)?;
        let is_watched =
            page_services.web.as_ref().is_some_and(|web| web.open() > 0) || look.is_interactive();
        if end.is_reached(now, &event_reader, look.is_played(), is_watched) {
            break;
        }
    }
    // Keep serving pages until all files are written, and keep the heartbeat of this process going meanwhile.
    let PageServices { web: _web, tape, black_box, .. } = page_services;
    let write_last = black_box.end();
    let (taped, kept) = member.run_with_heartbeat(move || (tape.finish(), write_last()));
    if let Err(error) = taped {
        tracing::error!("the recording is incomplete: {error}");
    }
    for words in kept {
        let line = event_reader.narrator.note(member.now().as_nanos(), &words);
        let _taken = out.write_all(transcript.text(&line).as_bytes());
    }
    let report = event_reader.report.of_this_run();
    if !report.tasks.is_empty() {
        let summary = format!("\nWhat Leo learned\n\n{}", report.to_text(&leo.belief.names));
        let _taken = out.write_all(summary.as_bytes());
    }
    out.finish();
    Ok(())
}

/// Subscribes to utterances and learner events.
struct EventReader {
    utterances: FrameSubscriber<Utterances>,
    events: FrameSubscriber<Events>,
    narrator: Narrator,
    report: LessonReport,
    lines: Lines,
    /// Number of utterances received.
    sentences_said: u32,
    /// Whether the report changed since it was last published.
    has_news: bool,
}

impl EventReader {
    fn open(member: &ProcessNode, robot: &Robot) -> Result<Self, ProcessError> {
        Ok(Self {
            utterances: member.subscriber(None)?,
            events: member.subscriber(None)?,
            narrator: Narrator::new(&robot.leo.belief.names),
            report: LessonReport::bounded(),
            lines: Lines::default(),
            sentences_said: 0,
            has_news: true,
        })
    }

    fn hear(&mut self) -> Result<Vec<Line>, ProcessError> {
        let mut lines = Vec::new();
        while let Some(frame) = self.utterances.receive()? {
            for utterance in frame.entries() {
                self.sentences_said += 1;
                lines.push(self.narrator.utterance(frame.head().valid_at_ns, utterance));
            }
        }
        while let Some(frame) = self.events.receive()? {
            for event in frame.entries() {
                // The learner repeats remembered tasks whenever a further subscriber joins.
                let is_known = event.kind() == Some(EventKind::Remembered)
                    && self.report.examples(event.task.as_str()) == Some(event.examples);
                let line = self.narrator.event(frame.head().valid_at_ns, event);
                lines.extend(line.filter(|_| !is_known));
                self.report.add(event);
                self.has_news = true;
            }
        }
        Ok(lines)
    }
}

/// The services for the pages: the server, the acts, recordings and the black box.
struct PageServices {
    web: Option<Web>,
    pending_acts: PendingActs,
    library: LessonLibrary,
    tape: Tape,
    black_box: BlackBox,
    arming: Arming,
    metrics_poller: MetricsPoller,
    joints: Vec<String>,
    agents: BTreeMap<u16, String>,
    cone_rad: f64,
}

impl PageServices {
    fn open(
        member: &ProcessNode,
        launch: &Launch,
        robot: &Robot,
        lesson: &Lesson,
    ) -> Result<Self, ProcessError> {
        let first = lesson.teachers.first().map_or(1, |teacher| teacher.number);
        let console = &robot.leo.console;
        let web = console.address.get().map(|address| {
            let served = Web::serve(Serving {
                address,
                port_required: console.port_required,
                before: ServerIdentity::read(&launch.domain, launch.state.as_deref()),
                urdf: robot.urdf.clone(),
                first,
                open: console.read_without_token,
                domain: launch.domain.clone(),
                moves_here: robot.leo.link.runs_here(Process::Motor),
                timeouts: Timeouts::default(),
            });
            match served {
                Ok(web) => Ok(Some(web)),
                Err(error) if console.port_required => {
                    Err(ProcessError::own(format!("cannot serve the page: {error}")))
                }
                // A missing page must not keep the robot from running.
                Err(error) => {
                    tracing::error!("cannot serve the page: {error}; the robot runs without it");
                    Ok(None)
                }
            }
        });
        let web = web.transpose()?.flatten();
        let library = LessonLibrary::new(&robot.leo, launch.state.as_deref(), lesson);
        if let Some(web) = &web {
            if let Err(error) = web.server_identity.persist(&launch.domain, launch.state.as_deref()) {
                tracing::warn!(%error, "pages may not find this robot again after a restart");
            }
            web.shared.state_store().put("lessons", &library.list());
        }
        let joints: Vec<String> = robot.motor.joints.iter().map(|joint| joint.name.clone()).collect();
        let names = &robot.leo.belief.names;
        let people = lesson.teachers.iter().map(|teacher| teacher.number);
        Ok(Self {
            pending_acts: PendingActs::open(member)?,
            tape: Tape::new(launch, lesson, Domain::at(&launch.domain)?),
            black_box: BlackBox::open(launch, robot, lesson),
            arming: Arming::new(&launch.domain, &joints),
            metrics_poller: MetricsPoller::new(&joints, launch.state.as_deref()),
            agents: [0, 1].into_iter().chain(people).map(|agent| (agent, names.of(agent))).collect(),
            cone_rad: robot.perspective.sight.cone_half_angle_deg.radians(),
            web,
            library,
            joints,
        })
    }

    /// Publishes what changes rarely.
    fn show(&mut self, now: Instant, member: &ProcessNode, look: &TopicPoller, report: &LessonReport) {
        let Some(web) = &self.web else { return };
        let mut state_store = web.shared.state_store();
        state_store.put(
            "workspace",
            &self.library.workspace(look.workspace.as_ref(), self.pending_acts.saved.as_deref()),
        );
        self.arming.show(now, member, &mut state_store);
        if !self.metrics_poller.is_due(now) {
            return;
        }
        self.tape.show(now, &mut state_store);
        state_store.put(
            "robot",
            &json!({
                "version": env!("CARGO_PKG_VERSION"), "joints": self.joints, "agents": self.agents,
                "base": look.base(), "cone_rad": self.cone_rad, "perspectives": look.perspective_names(),
            }),
        );
        let metrics = self.metrics_poller.look(now, member, report, &mut state_store);
        drop(state_store);
        if let Some(metrics) = metrics {
            web.shared.set_metrics(metrics);
        }
    }

    /// Executes the pages' requests and answers them.
    fn answer(&mut self, now: Instant, look: &TopicPoller) -> Result<(), ProcessError> {
        let Some(web) = &self.web else { return Ok(()) };
        let asked = std::iter::from_fn(|| web.pending_requests.try_recv().ok());
        for asked in self.pending_acts.forward(now, look.workspace.is_some(), asked)? {
            match asked.page_request {
                PageRequest::Record(on) => self.tape.ask(on, asked.requester),
                PageRequest::Arm(locks) => self.arming.ask(now, locks, asked.requester),
                PageRequest::Keep => self.black_box.ask(Requester::Page(asked.requester)),
                PageRequest::Act(_) => {}
            }
        }
        self.arming.step(now);
        if self.tape.step(now) {
            self.tape.show(now, &mut web.shared.state_store());
        }
        let saved = self.pending_acts.saved.clone();
        self.pending_acts.answer(now)?;
        if self.pending_acts.saved != saved {
            web.shared.state_store().put("lessons", &self.library.list());
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

    fn is_reached(
        &mut self,
        now: Instant,
        event_reader: &EventReader,
        is_played: bool,
        is_watched: bool,
    ) -> bool {
        self.was_watched |= is_watched;
        let has_performed = if self.performances > 0 {
            event_reader.report.performances_ended() >= self.performances
        } else {
            is_played
        };
        let is_over = event_reader.sentences_said >= self.sentences && has_performed;
        if is_watched || self.stays || !is_over {
            self.over_since = None;
            return false;
        }
        let timeouts = if self.was_watched { RELOAD_GRACE } else { ANSWER_GRACE };
        now.since(*self.over_since.get_or_insert(now)) >= timeouts
    }
}
