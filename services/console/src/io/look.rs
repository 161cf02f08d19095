//! Polls the robot's topics for the pages and for the transcript.

use config::{Names, Robot};
use geometry::Pose;
use message::{
    Belief, BeliefHead, Beliefs, Difference, Divergences, JointMode, JointState, JointStates, Scene,
    SceneHead, SceneMode,
};
use process::{ProcessError, ProcessNode};
use reports::beliefs::{DivergenceReporter, perspective_name};
use serde_json::json;
use transport::FrameSubscriber;

use crate::cells::{BeliefRenderer, Seen, TimeLines, belief_in, joints, numbers, scene};
use crate::state_store::StateStore;

/// Beliefs are published at every fifth poll, which is 10 Hz at the default rate: enough for readers.
const BELIEFS_EVERY: u32 = 5;

/// The message for a robot that perceives more than its buffers hold.
const OVERFLOW_MESSAGE: &str = "there is more than I have room for, and some of it is left out: raise \
                       `buffers.max_objects` in leo.toml, or `occluders.max_count` in perspective.toml";

/// Subscribers that read the newest frame of each topic. Skipped frames do not count as drops.
pub(crate) struct TopicPoller {
    names: Names,
    joint_names: Vec<String>,
    belief_renderer: BeliefRenderer,
    histories: TimeLines,
    joint_states: FrameSubscriber<JointStates>,
    scene: FrameSubscriber<Scene>,
    perspectives: Vec<Perspective>,
    partners: u32,
    looks: u32,
    /// Joints that were quarantined at the last poll.
    pub(crate) quarantined: Vec<u32>,
    /// Whether the overflow message was shown.
    crowded: bool,
    /// The newest head of the simulator's scene.
    pub(crate) workspace: Option<SceneHead>,
    /// Origin of the displayed time, in nanoseconds.
    first_ns: Option<u64>,
    robots: Vec<Seen>,
}

/// The subscribers of one perspective, with the newest data.
struct Perspective {
    beliefs: FrameSubscriber<Beliefs>,
    /// `None` for the robot's own perspective.
    divergences: Option<FrameSubscriber<Divergences>>,
    divergence_reporter: Option<DivergenceReporter>,
    head: BeliefHead,
    believed: Vec<Belief>,
    differing: Vec<Difference>,
    /// Incarnation of the belief process that the data is of. Each incarnation assigns new identities.
    incarnation: u64,
}

impl TopicPoller {
    /// Subscribes to the topics, including those of the partners' perspectives.
    pub(crate) fn open(member: &ProcessNode, robot: &Robot, partners: u32) -> Result<Self, ProcessError> {
        let names = robot.leo.belief.names.clone();
        let count = robot.leo.belief.perspectives(partners);
        let open = |number: u32| {
            let is_partner = number >= 1 && number <= partners;
            let name = u16::try_from(number).map_or(String::new(), |partner| names.of(partner));
            Ok(Perspective {
                beliefs: member.subscriber(Some(number))?,
                divergences: if number == 0 { None } else { Some(member.subscriber(Some(number))?) },
                divergence_reporter: is_partner.then(|| DivergenceReporter::new(&robot.percepts, &name)),
                head: BeliefHead::default(),
                believed: Vec::new(),
                differing: Vec::new(),
                incarnation: 0,
            })
        };
        Ok(Self {
            joint_names: robot.motor.joints.iter().map(|joint| joint.name.clone()).collect(),
            belief_renderer: BeliefRenderer::new(robot),
            histories: TimeLines::default(),
            joint_states: member.subscriber(None)?,
            scene: member.subscriber(None)?,
            perspectives: (0..count).map(open).collect::<Result<_, ProcessError>>()?,
            names,
            partners,
            looks: 0,
            quarantined: Vec::new(),
            crowded: false,
            workspace: None,
            first_ns: None,
            robots: Vec::new(),
        })
    }

    /// Seconds since the first instant that was displayed.
    pub(crate) fn seconds(&mut self, at_ns: u64) -> f64 {
        let first = *self.first_ns.get_or_insert(at_ns);
        clock::Instant::from_nanos(at_ns).since(clock::Instant::from_nanos(first)).as_secs_f64()
    }

    /// Polls the topics and publishes what is new. Calls `tell` with the differences between partners and robot, each
    /// with its instant.
    pub(crate) fn look(
        &mut self,
        state_store: &mut StateStore,
        mut tell: impl FnMut(u64, &str),
    ) -> Result<(), ProcessError> {
        if let Some(frame) = self.joint_states.newest()? {
            joints(state_store, &self.joint_names, frame.entries());
            let is_quarantined = |state: &&JointState| state.mode() == Some(JointMode::Quarantined);
            self.quarantined.clear();
            self.quarantined.extend(frame.entries().iter().filter(is_quarantined).map(|state| state.joint));
        }
        if let Some(frame) = self.scene.newest()? {
            let head = *frame.head();
            let base = Pose::from_parts(head.base_position_m, head.base_orientation_xyzw);
            self.belief_renderer.x_world_base = base.unwrap_or_else(Pose::identity);
            scene(state_store, frame.entries(), |thing| belief_in(thing, &self.robots));
            self.workspace = Some(head);
        }
        let first = self.perspectives.first().map_or(0, |robot| robot.incarnation);
        for perspective in &mut self.perspectives {
            perspective.read()?;
        }
        if self.perspectives.first().is_some_and(|robot| robot.incarnation != first) {
            self.histories.forget();
        }
        self.tell(&mut tell);
        self.looks = self.looks.wrapping_add(1);
        if self.looks.is_multiple_of(BELIEFS_EVERY) {
            self.show(state_store);
        }
        Ok(())
    }

    /// The overflow message, once, if some perspective or one of its inputs overflowed.
    pub(crate) fn crowded(&mut self) -> Option<&'static str> {
        let leaves_out = |head: &BeliefHead| head.overflowed > 0 || head.header.over_capacity > 0;
        let is_crowded = self.perspectives.iter().any(|perspective| leaves_out(&perspective.head));
        (is_crowded && !std::mem::replace(&mut self.crowded, is_crowded)).then_some(OVERFLOW_MESSAGE)
    }

    fn tell(&mut self, tell: &mut impl FnMut(u64, &str)) {
        let Some((robot, others)) = self.perspectives.split_first_mut() else { return };
        for partner in others {
            let Some(reporter) = &mut partner.divergence_reporter else { continue };
            let at_ns = partner.head.header.valid_at_ns;
            if partner.incarnation != 0 && at_ns != 0 {
                reporter.update(at_ns, &partner.differing, &robot.believed, &partner.believed, |words| {
                    tell(at_ns, words);
                });
            }
        }
    }

    fn show(&mut self, state_store: &mut StateStore) {
        let at_ns = self.perspectives.first().map_or(0, |robot| robot.head.header.valid_at_ns);
        if at_ns == 0 {
            return;
        }
        let t = self.seconds(at_ns);
        let Some((robot, others)) = self.perspectives.split_first() else { return };
        let robots = self.belief_renderer.show(state_store, &robot.head, &robot.believed, None, &[]);
        self.histories.note(t, 0, &robots, |id| robots.iter().find(|seen| seen.id == id));
        for other in others {
            let (head, differing) = (&other.head, other.differing.as_slice());
            if other.incarnation == 0 {
                continue;
            }
            let his = self.belief_renderer.show(state_store, head, &other.believed, Some(&robots), differing);
            if head.perspective <= self.partners {
                let name = u16::try_from(head.perspective).map_or(String::new(), |it| self.names.of(it));
                self.belief_renderer.divide(
                    state_store,
                    head.perspective,
                    &name,
                    differing,
                    &robot.believed,
                    &other.believed,
                );
            }
            let twins: std::collections::BTreeMap<u64, &Seen> = his
                .iter()
                .filter_map(|seen| Some((crate::cells::counterpart(seen, &robots, differing)?, seen)))
                .collect();
            self.histories.note(t, head.perspective, &robots, |id| twins.get(&id).copied());
        }
        self.histories.show(state_store, &robots);
        state_store.put("now", &json!({ "t": crate::cells::rounded(t, 1.0) }));
        self.robots = robots;
    }

    /// The robot's base in the world frame; zero without a simulator.
    pub(crate) fn base(&self) -> serde_json::Value {
        let head = self.workspace.unwrap_or_default();
        json!({ "p": numbers(head.base_position_m), "q": numbers(head.base_orientation_xyzw) })
    }

    /// The names of the perspectives, by number.
    pub(crate) fn perspective_names(&self) -> serde_json::Value {
        let named = self.perspectives.iter().enumerate().map(|(number, perspective)| {
            let agents = perspective.head.path.agents().unwrap_or(&[]);
            let fallback = u16::try_from(number).ok().filter(|number| *number > 0);
            let agents: Vec<u16> =
                if agents.is_empty() { fallback.into_iter().collect() } else { agents.to_vec() };
            let name = perspective_name(&self.names, &agents);
            json!({ "number": number, "name": name, "agents": agents })
        });
        named.collect()
    }

    /// Whether the lesson is interactive instead of scripted.
    pub(crate) fn is_interactive(&self) -> bool {
        let mode = self.workspace.and_then(|head| head.mode());
        matches!(mode, Some(SceneMode::SetUp | SceneMode::Teaching))
    }

    /// Whether the lesson's script has been played to its end.
    pub(crate) fn is_played(&self) -> bool {
        self.workspace.is_some_and(|head| head.mode() == Some(SceneMode::Over))
    }
}

impl Perspective {
    fn read(&mut self) -> Result<(), ProcessError> {
        if let Some(frame) = self.beliefs.newest()? {
            self.head = *frame.head();
            self.believed.clear();
            self.believed.extend_from_slice(frame.entries());
            let incarnation = frame.head().header.incarnation;
            if std::mem::replace(&mut self.incarnation, incarnation) != incarnation {
                self.differing.clear();
                if let Some(reporter) = &mut self.divergence_reporter {
                    reporter.reset();
                }
            }
        }
        if let Some(divergences) = &mut self.divergences
            && let Some(frame) = divergences.newest()?
        {
            self.differing.clear();
            if frame.head().compared != 0 {
                self.differing.extend_from_slice(frame.entries());
            }
        }
        Ok(())
    }
}
