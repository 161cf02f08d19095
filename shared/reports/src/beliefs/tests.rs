use belief::percepts::Percepts;
use message::{Aspect, Belief, BeliefHead, Difference, Feature, Header, NOBODY, Remembered};
use perspective::{Divergence, PerspectiveBeliefs};

use super::{BeliefReport as _, JsonLines, PerceptPhrases, PerspectiveRecord, Refusal, Summary, Timeline};

/// Builds the perspectives of a test, instant by instant.
struct Story {
    percepts: Percepts,
    divergence: Divergence,
    timeline: Timeline,
    text: String,
    json: String,
}

/// A belief: its identity, position and colour, whether it is on, and its holder.
type Known = (u64, [f32; 3], u16, Option<f32>, u16);

const HERE: [f32; 3] = [0.5, 0.0, 0.0];

impl Story {
    fn new() -> Self {
        let percepts = Percepts::builtin();
        let divergence = Divergence::new(&percepts, 8);
        let timeline = Timeline::new(&percepts);
        Self { percepts, divergence, timeline, text: String::new(), json: String::new() }
    }

    fn beliefs(&self, at_ns: u64, known: &[Known]) -> Vec<Belief> {
        let known = known.iter().map(|(id, place, colour, on, held_by)| {
            let mut belief = Belief::new(*id, 1, at_ns, 3, *held_by);
            let mut push = |percept: &str, feature| {
                let number = self.percepts.index(percept).unwrap();
                assert!(belief.push(Remembered::new(number, at_ns, 1.0, 0.5, feature)));
            };
            push("position", Feature::Vector(*place));
            push("shape", Feature::Symbol(0));
            push("colour", Feature::Symbol(*colour));
            if let Some(on) = on {
                push("on", Feature::Number(*on));
            }
            belief
        });
        known.collect()
    }

    /// An instant with the beliefs of the robot and, if present, of a partner at (2, 0, 0).
    fn instant(&mut self, at_ms: u64, robots: &[Known], his: Option<&[Known]>) -> String {
        let at_ns = at_ms * 1_000_000;
        let robot = BeliefHead { present: 1, ..BeliefHead::of(0, Header::at(at_ns)) };
        let partner = BeliefHead {
            present: u32::from(his.is_some()),
            created: 9,
            frame_position_m: [2.0, 0.0, 0.0],
            ..BeliefHead::of(1, Header::at(at_ns))
        };
        let (robots, his) = (self.beliefs(at_ns, robots), self.beliefs(at_ns, his.unwrap_or(&[])));
        self.divergence.compare(
            PerspectiveBeliefs { head: &robot, beliefs: &robots },
            PerspectiveBeliefs { head: &partner, beliefs: &his },
        );
        let minds = [
            PerspectiveRecord { head: &robot, beliefs: &robots, pairs: &[], differences: &[] },
            PerspectiveRecord {
                head: &partner,
                beliefs: &his,
                pairs: self.divergence.pairs(),
                differences: self.divergence.differences(),
            },
        ];
        let before = self.text.len();
        self.timeline.append(at_ns, &minds, &mut self.text);
        JsonLines::new(&self.percepts).append(at_ns, &minds, &mut self.json);
        self.text[before..].to_owned()
    }
}

/// The same position in the frame of a partner at (2, 0, 0).
fn from_there([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x - 2.0, y, z]
}

#[test]
fn beginning_change_and_end_of_a_belief_are_reported_once() {
    let mut story = Story::new();
    let block = |on, held_by| [(1, HERE, 0, Some(on), held_by)];
    let green = [(1, HERE, 1, Some(1.0), NOBODY)];
    let lines: Vec<usize> = [
        story.instant(5000, &block(0.0, NOBODY), None),
        story.instant(5500, &block(0.1, NOBODY), None),
        story.instant(6000, &block(1.0, 2), None),
        story.instant(6100, &block(1.0, NOBODY), None),
        story.instant(6200, &green, None),
        story.instant(6300, &[], None),
    ]
    .iter()
    .map(|told| told.lines().count())
    .collect();
    assert_eq!(lines, [2, 0, 2, 1, 1, 1]);
    insta::assert_snapshot!(story.text);
}

/// A belief at a place with these symbols, and nothing else.
fn partly(percepts: &Percepts, symbols: &[(&str, u16)]) -> Belief {
    let mut belief = Belief::new(1, 1, 5_000_000_000, 3, NOBODY);
    let mut push = |percept: &str, feature| {
        let number = percepts.index(percept).unwrap();
        assert!(belief.push(Remembered::new(number, 5, 1.0, 0.5, feature)));
    };
    push("position", Feature::Vector(HERE));
    symbols.iter().for_each(|(percept, symbol)| push(percept, Feature::Symbol(*symbol)));
    belief
}

#[test]
fn what_was_not_observed_is_not_named() {
    let percepts = Percepts::builtin();
    let words = PerceptPhrases::of(&percepts);
    let (square, red) = (("shape", 0), ("colour", 0));
    for (symbols, expected) in
        [(&[][..], "thing"), (&[red], "red thing"), (&[square], "square"), (&[square, red], "red square")]
    {
        assert_eq!(words.thing(&partly(&percepts, symbols)), expected);
    }
}

#[test]
fn an_attribute_that_becomes_known_is_no_correction() {
    let percepts = Percepts::builtin();
    let mut timeline = Timeline::new(&percepts);
    let mut text = String::new();
    let (square, red, green) = (("shape", 0), ("colour", 0), ("colour", 1));
    for (second, symbols) in
        [(5, &[][..]), (6, &[square]), (7, &[square, red]), (8, &[square, red]), (9, &[square, green])]
    {
        let at_ns = second * 1_000_000_000;
        let head = BeliefHead { present: 1, ..BeliefHead::of(0, Header::at(at_ns)) };
        let beliefs = [partly(&percepts, symbols)];
        let mind = PerspectiveRecord { head: &head, beliefs: &beliefs, pairs: &[], differences: &[] };
        timeline.append(at_ns, &[mind], &mut text);
    }
    let lines: Vec<&str> = text.lines().map(|line| line.split("1: ").last().unwrap()).collect();
    assert_eq!(
        lines,
        [
            "thing at (0.50, 0.00, 0.00)",
            "is a square",
            "is a red square",
            "is a green square, not a red square"
        ]
    );
}

#[test]
fn what_a_partner_does_not_know_is_no_mistake() {
    let percepts = Percepts::builtin();
    let words = PerceptPhrases::of(&percepts);
    let sentence = |aspects: &[(&str, bool, bool)]| {
        let mut difference = Difference::new(Some(3), Some(8));
        for (name, robots, theirs) in aspects {
            let feature = |is_known: bool| is_known.then_some(Feature::Symbol(0));
            let percept = percepts.index(name).unwrap();
            assert!(difference.push(Aspect::new(percept, feature(*robots), feature(*theirs), None)));
        }
        words.divergence("partner 1", "red square", &difference)
    };
    assert_eq!(
        [
            sentence(&[("shape", true, false), ("colour", true, false)]),
            sentence(&[("colour", false, true)]),
            sentence(&[("shape", true, false), ("colour", true, true)]),
            sentence(&[("position", true, true), ("colour", true, false)]),
        ],
        [
            "partner 1 does not know everything about the red square: shape, colour",
            "partner 1 has beliefs about the red square that Leo lacks: colour",
            "partner 1 is mistaken about the red square: colour",
            "partner 1 does not know that the red square moved",
        ]
    );
}

#[test]
fn a_moving_object_is_reported_once_it_rests() {
    let mut story = Story::new();
    let at = |y: f32| [(1, [0.5, y, 0.0], 0, None, NOBODY)];
    story.instant(0, &at(0.0), None);
    for (step, y) in [(1_u64, 0.02), (2, 0.04), (3, 0.1), (4, 0.2), (5, 0.3), (6, 0.3), (7, 0.3)] {
        assert_eq!(story.instant(step * 50, &at(y), None), "", "{step}");
    }
    assert!(story.instant(450, &at(0.301), None).ends_with(" Leo         1: moved to (0.50, 0.30, 0.00)\n"));
    assert_eq!(story.instant(1000, &at(0.305), None), "");
}

#[test]
fn divergences_and_their_ends_are_reported() {
    let mut story = Story::new();
    let (red, seen) = ((4, HERE, 0, Some(1.0), NOBODY), (7, from_there(HERE), 0, Some(1.0), NOBODY));
    assert!(story.instant(0, &[red], None).ends_with("partner 1   does not know of Leo's 4\n"));
    assert_eq!(
        story.instant(100, &[red], Some(&[seen])),
        "[   0.10 s] partner 1   is there\n\
         [   0.10 s] partner 1   believes in 7: red square at (0.50, 0.00, 0.00), on\n\
         [   0.10 s] partner 1   7 agrees with Leo's 4\n"
    );
    let off = (7, from_there(HERE), 0, Some(0.0), NOBODY);
    assert!(story.instant(200, &[red], Some(&[off])).ends_with("partner 1   7 differs from Leo's 4: on\n"));
    assert!(story.instant(300, &[], Some(&[off])).ends_with("partner 1   alone believes in 7\n"));
    assert_eq!(story.instant(400, &[], None).lines().count(), 2);
}

#[test]
fn the_final_table_lists_the_differences_and_the_input() {
    let percepts = Percepts::builtin();
    let mut story = Story::new();
    story.instant(
        0,
        &[(4, HERE, 0, Some(1.0), NOBODY)],
        Some(&[(7, from_there(HERE), 0, Some(0.0), NOBODY)]),
    );
    let differences: Vec<Difference> = story.divergence.differences().to_vec();
    let beliefs = story.beliefs(0, &[(7, from_there(HERE), 0, Some(0.0), 0)]);
    let head = BeliefHead {
        present: 1,
        frame_position_m: [2.0, 0.0, 0.0],
        overflowed: 12,
        refused: 13,
        ..BeliefHead::of(1, Header::at(2_000_000_000))
    };
    let mind = PerspectiveRecord { head: &head, beliefs: &beliefs, pairs: &[], differences: &differences };
    let away = BeliefHead::of(2, Header::at(2_000_000_000));
    let nobody = PerspectiveRecord { head: &away, beliefs: &[], pairs: &[], differences: &[] };
    let refused = Refusal { reason: "no number".to_owned(), observations: 3, first: "line 4".to_owned() };
    let summary = Summary {
        first_at_ns: Some(0),
        last_at_ns: Some(2_000_000_000),
        frames: 5,
        earlier: 2,
        observations: 9,
        refused: vec![refused],
        left_out: 0,
        cut_short: true,
        not_simulated: [3, 4].into(),
        literal: Vec::new(),
    };
    let mut out = String::new();
    Timeline::new(&percepts).finish(&[mind, nobody], &summary, &mut out);
    // Names and numbers; the snapshot has the sentences.
    for fact in [
        "2.00 s",
        "     7  red square at (0.50, 0.00, 0.00), not on",
        "7, which is Leo's 4",
        "  12 observations, beliefs or occluders ",
        "  13 observations or evaluations ",
        "buffers.max_objects",
        "5 frames, 9 observations\n3 observations refused: no number (the first: line 4)\n2 frames ",
        "partner 3, partner 4",
        "--partners 4",
    ] {
        assert!(out.contains(fact), "{fact} is not in\n{out}");
    }
    let mut pages = out;
    let path = head.path.within(0).and_then(|path| path.within(2)).unwrap();
    let nested = BeliefHead { path, present: 1, ..BeliefHead::of(5, Header::at(2_000_000_000)) };
    let nested = PerspectiveRecord { head: &nested, beliefs: &[], pairs: &[], differences: &[] };
    pages.push_str("\n---- a nested perspective ----\n");
    Timeline::new(&percepts).finish(&[nested], &summary, &mut pages);
    insta::assert_snapshot!(pages);
    let mut json = String::new();
    JsonLines::new(&percepts).finish(&[mind], &summary, &mut json);
    let line: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(line["refused"][0]["observations"], 3);
    assert_eq!((&line["record"], &line["perspectives"][0]["beliefs"]), (&"summary".into(), &1.into()));
}

#[test]
fn json_has_raw_numbers_and_names_of_symbols() {
    let mut story = Story::new();
    story.instant(
        7,
        &[(4, [0.1, 0.0, 0.0], 2, Some(1.0), NOBODY)],
        Some(&[(9, from_there(HERE), 2, None, 1)]),
    );
    let lines: Vec<&str> = story.json.lines().collect();
    assert_eq!(lines.len(), 5, "{}", story.json);
    assert_eq!(
        lines[1],
        r#"{"record":"belief","at_ns":7000000,"perspective":0,"id":4,"robot_id":4,"born_at_ns":1,"perceived_at_ns":7000000,"observations":3,"held_by":null,"owner":null,"percepts":{"position":{"m":1.0,"c":0.5,"feature":[0.1,0.0,0.0],"sampled_at_ns":7000000},"shape":{"m":1.0,"c":0.5,"feature":"square","sampled_at_ns":7000000},"colour":{"m":1.0,"c":0.5,"feature":"blue","sampled_at_ns":7000000},"on":{"m":1.0,"c":0.5,"feature":1.0,"sampled_at_ns":7000000}}}"#
    );
    assert!(lines[2].starts_with(
        r#"{"record":"perspective","at_ns":7000000,"perspective":1,"path":[1],"present":true,"beliefs":1"#
    ));
    // The two look the same, and nothing was compared while both were new.
    assert!(
        lines[3].contains(r#""id":9,"robot_id":4"#) && lines[3].contains(r#""held_by":1"#),
        "{}",
        lines[3]
    );
    assert!(lines[4].starts_with(r#"{"record":"difference","at_ns":7000000,"perspective":1,"robot_id":4,"partner_id":9,"percepts":{"position":{"robot":[0.1,0.0,0.0],"partner":[0.5,0.0,0.0],"distance":0.39"#));
    assert!(lines[4].ends_with(r#""on":{"robot":1.0,"partner":null,"distance":null}}}"#), "{}", lines[4]);
}
