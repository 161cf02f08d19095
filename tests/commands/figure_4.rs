//! The timeline of Fig. 4 of the paper, as the processes publish it in the lesson.

use std::collections::BTreeMap;

use belief::percepts::Percepts;
use message::{Belief, Beliefs, TopicId};

use crate::harness::run_leo;
use crate::recordings::{file, frames};

/// Whether an agent believes that the button is pressed, and when it was last perceived.
type Pressed = (bool, u64);

/// The button in a frame of beliefs: a red square, whose hole the peg fills.
fn button(percepts: &Percepts, beliefs: &[Belief]) -> Option<Pressed> {
    let is = |belief: &Belief, percept: &str, name: &str| {
        let number = percepts.index(percept).expect("configured");
        let symbols = percepts.percepts.get(usize::from(number)).map(belief::percepts::Percept::symbols);
        let known = symbols.and_then(|mut symbols| symbols.position(|known| known == name));
        belief.symbol(number).map(usize::from) == Some(known.expect("a symbol"))
    };
    let mut buttons =
        beliefs.iter().filter(|belief| is(belief, "shape", "square") && is(belief, "colour", "red"));
    let button = buttons.next()?;
    assert!(buttons.next().is_none(), "there is one button");
    let filled = button.number(percepts.index("filled").expect("configured"))?;
    Some((filled > 0.5, button.perceived_at_ns))
}

#[test]
fn the_partner_believes_the_last_seen_state_of_the_button() {
    let folder = tempfile::tempdir().expect("a folder");
    let to = file(&folder, "button.mcap");
    let output = run_leo(&["teach", "config/lessons/the_button.toml", "--record", &to]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");

    let percepts = Percepts::builtin();
    let mut believed: BTreeMap<u64, [Option<Pressed>; 2]> = BTreeMap::new();
    for frame in frames(&to) {
        let of_both = [TopicId::Beliefs(0), TopicId::Beliefs(1)];
        let Some(perspective) = of_both.iter().position(|topic| *topic == frame.topic) else { continue };
        let (head, beliefs) = frame.read::<Beliefs>().expect("beliefs of this version");
        believed.entry(head.header.valid_at_ns).or_default()[perspective] = button(&percepts, &beliefs);
    }
    let both = believed.iter().filter_map(|(at_ns, [robots, his])| Some((*at_ns, (*robots)?, (*his)?)));
    let both: Vec<(u64, Pressed, Pressed)> = both.collect();
    let spans: Vec<_> = both.chunk_by(|a, b| (a.1.0, a.2.0) == (b.1.0, b.2.0)).collect();

    // Not pressed for both; pressed behind the partner's back; the partner looks again.
    let sequence: Vec<_> = spans.iter().map(|span| (span[0].1.0, span[0].2.0)).collect();
    assert_eq!(sequence, [(false, false), (true, false), (true, true)]);
    // Pressed 4.5 s after the start, seen again by the partner between 8 s and 9 s.
    let apart_ms = |span: &[(u64, Pressed, Pressed)]| (span[span.len() - 1].0 - span[0].0) / 1_000_000;
    assert!((3_400..4_700).contains(&apart_ms(spans[1])), "{} ms", apart_ms(spans[1]));
    // Meanwhile the robot perceives the button and the partner does not: the partner's belief is from before
    // they turned away.
    let [first, .., last] = spans[1] else { panic!("more than one frame") };
    assert!(last.1.1 > first.1.1 && last.2.1 == first.2.1 && first.2.1 + 1_000_000_000 < first.0);
}
