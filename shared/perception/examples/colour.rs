//! The colour of an object by its nearest prototype: `cargo run -p leo-perception --example colour`.
//!
//! An evaluation enters the percept snapshot if match times confidence exceeds the threshold. Between two prototypes
//! none does.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;

use message::{Feature, Observation};
use perception::percepts::{Definition, Kernel, Nearest, Prototype, Space};
use perception::{Frame, PerceptSet, Perception};
use settings::number::Positive;

fn main() -> Result<(), Box<dyn Error>> {
    let names = ["red", "blue"];
    let prototype = |name: &str, at: [f64; 3]| Prototype { name: name.to_owned(), at: at.to_vec() };
    let prototypes = vec![prototype("red", [0.8, 0.05, 0.05]), prototype("blue", [0.05, 0.15, 0.8])];
    let nearest =
        Kernel::Nearest(Nearest { space: Space::Colour, scale: Positive::try_from(0.6)?, prototypes });
    nearest.check(None)?;
    let colour = Definition { name: "colour", parent: None, kernel: &nearest };
    let perception = Perception::new(PerceptSet { threshold: 0.5, percepts: vec![colour] })?;

    let mut perceived = 0;
    for colour_rgb in [[0.75, 0.1, 0.1], [0.1, 0.1, 0.7], [0.42, 0.1, 0.42]] {
        let seen = Observation { colour_rgb, confidence: 0.9, ..Observation::object(0, 1) };
        let snapshot = perception.perceive(&seen, &Frame { agent: 0 });
        let value = snapshot.value(0);
        let symbol = value.and_then(|value| match value.feature()? {
            Feature::Symbol(symbol) => names.get(usize::from(symbol)),
            Feature::None | Feature::Number(_) | Feature::Vector(_) | Feature::Orientation(_) => None,
        });
        match (symbol, value) {
            (Some(name), Some(value)) => {
                println!(
                    "{colour_rgb:?}: {name}, match {:.2}, confidence {:.2}",
                    value.matching, value.confidence
                );
                perceived += 1;
            }
            (None, _) | (_, None) => println!("{colour_rgb:?}: no colour that is certain enough"),
        }
    }
    assert_eq!(perceived, 2, "the third colour lies between the prototypes");
    Ok(())
}
