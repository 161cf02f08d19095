//! Time to add one example and compute the result, and memory of the learner: `cargo bench -p leo-tasks`. The time is
//! compared with a full enumeration of all templates and classes after every example.
//!
//! The objects are of random kinds; those with one of two values of the first feature are marked.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::hint::black_box;

use quantity::number::float;
use tasks::{
    FeatureWords, HypothesisLanguage, Language, Learning, Noise, Object, Settings, Snapshot, StateWords, View,
};

/// Number of values of each feature.
const VALUES: u64 = 4;
/// The enumeration is skipped above this size.
const MAX_ENUMERATED: u64 = 3_000_000;

/// Pseudo-random numbers from a fixed seed (splitmix64).
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }
}

fn language(features: u64) -> Language {
    let words = |feature: u64| FeatureWords {
        percept: 0,
        name: format!("f{feature:02}"),
        values: (0..VALUES).map(|value| format!("v{value}")).collect(),
    };
    Language {
        features: (0..features).map(words).collect(),
        states: vec![StateWords { percept: 0, name: "marked".to_owned() }],
        position: 0,
        orientation: None,
        extents: None,
        moved_m: 0.03,
    }
}

fn demonstration(chance: &mut Chance, objects: u64, features: u64) -> View {
    let mut before = Vec::new();
    for id in 0..objects {
        let mut value = |feature| (format!("f{feature:02}"), format!("v{}", chance.below(VALUES)));
        before.push(Object {
            id,
            features: (0..features).map(&mut value).collect(),
            states: BTreeMap::from([("marked".to_owned(), false)]),
            position_m: Some([float(chance.below(100)) * 0.01, float(chance.below(100)) * 0.01, 0.0]),
            ..Object::default()
        });
    }
    let mut after = before.clone();
    for object in &mut after {
        let is_meant = object.features.get("f00").is_some_and(|value| value == "v0" || value == "v1");
        object.states.insert("marked".to_owned(), is_meant);
    }
    let snapshot = |objects| Snapshot { objects, ..Snapshot::default() };
    View { perspective: 0, before: snapshot(before), after: snapshot(after), executables: Vec::new() }
}

/// Tests, under all templates, the classes of every demonstration and of all joined on every demonstration. Returns how
/// many are consistent with all.
fn enumerate(views: &[View], features: u64) -> usize {
    let mut consistent = 0;
    for mask in 0..1_u64 << features {
        let template: Vec<String> =
            (0..features).filter(|bit| mask >> bit & 1 == 1).map(|bit| format!("f{bit:02}")).collect();
        let class = |object: &Object| -> Vec<String> {
            template.iter().filter_map(|name| object.features.get(name).cloned()).collect()
        };
        let is_marked = |object: &Object| object.states.get("marked") == Some(&true);
        let shown: Vec<Vec<(Vec<String>, bool)>> = views
            .iter()
            .map(|view| view.after.objects.iter().map(|object| (class(object), is_marked(object))).collect())
            .collect();
        let of_one = |objects: &Vec<(Vec<String>, bool)>| -> BTreeSet<Vec<String>> {
            objects.iter().filter(|(_, marked)| *marked).map(|(class, _)| class.clone()).collect()
        };
        let mut sets: BTreeSet<BTreeSet<Vec<String>>> = shown.iter().map(of_one).collect();
        sets.insert(sets.iter().flatten().cloned().collect());
        for set in sets {
            let fits = |objects: &Vec<(Vec<String>, bool)>| {
                objects.iter().all(|(class, marked)| set.contains(class) == *marked)
            };
            consistent += usize::from(shown.iter().all(fits));
        }
    }
    consistent
}

/// p50, p99 and maximum, in milliseconds.
fn timing_text(mut nanos: Vec<u64>) -> String {
    nanos.sort_unstable();
    let at = |share: usize| {
        let index = (nanos.len().max(1) - 1) * share / 100;
        float(nanos.get(index).copied().unwrap_or(0)) / 1e6
    };
    format!("{:9.3} {:9.3} {:9.3}", at(50), at(99), at(100))
}

fn timed(work: impl FnOnce()) -> u64 {
    let begin = clock::now();
    work();
    u64::try_from(clock::now().since(begin).as_nanos()).unwrap_or(u64::MAX)
}

/// The time of each example, and the memory after the last one in KiB.
fn learn(language: &Language, settings: &Settings, views: &[View], rounds: usize) -> String {
    let mut nanos = Vec::with_capacity(rounds * views.len());
    let mut kept = 0;
    for _ in 0..rounds {
        let (learning, bytes) = testkit::bytes_retained_by(|| {
            let mut learning = Learning::new(language, settings);
            for view in views {
                nanos.push(timed(|| {
                    learning.add(view);
                    black_box(learning.leading(8, 10.0));
                }));
            }
            learning
        });
        kept = bytes / 1024;
        drop(learning);
    }
    format!("{} {kept:7}", timing_text(nanos))
}

fn main() {
    let slips = Noise::try_from(0.05).expect("it is in range");
    println!("one more example and the 8 best rules: p50, p99 and max in ms, and memory in KiB");
    println!(
        "objects features examples                paper                 paper, label noise                   enumeration"
    );
    let sizes = [10, 30, 100, 300, 1000]
        .into_iter()
        .flat_map(|objects| [3, 6, 12].map(|features| (objects, features)));
    for (objects, features) in sizes {
        for examples in [1_u64, 5, 20] {
            let mut chance = Chance(objects * 1_000 + features);
            let views: Vec<View> =
                (0..examples).map(|_| demonstration(&mut chance, objects, features)).collect();
            let language = language(features);
            let rounds = if objects * features > 1000 { 1 } else { 3 };
            let paper = learn(&language, &Settings::default(), &views, rounds);
            let noisy = learn(&language, &Settings { noise: slips, ..Settings::default() }, &views, rounds);
            let size = (objects * examples * examples) << features;
            let enumeration = if size <= MAX_ENUMERATED {
                timing_text(vec![timed(|| {
                    black_box(enumerate(&views, features));
                })])
            } else {
                "                  (left out)".to_owned()
            };
            println!("{objects:7} {features:8} {examples:8} {paper} {noisy} {enumeration}");
        }
    }
    println!("\nthe extended language, 3 features");
    println!("objects examples               exact                          label noise");
    for objects in [10, 30, 100, 300] {
        let mut chance = Chance(objects);
        let views: Vec<View> = (0..20).map(|_| demonstration(&mut chance, objects, 3)).collect();
        let extended = Settings { language: HypothesisLanguage::Extended, ..Settings::default() };
        let exact = learn(&language(3), &extended, &views, 1);
        let noisy = learn(&language(3), &Settings { noise: slips, ..extended }, &views, 1);
        println!("{objects:7} {:8} {exact} {noisy}", views.len());
    }
    println!("\n10000 examples of 7 objects with 3 features: total in s, last example in ms");
    let mut chance = Chance(7);
    let views: Vec<View> = (0..10_000).map(|_| demonstration(&mut chance, 7, 3)).collect();
    for language_of in [HypothesisLanguage::Paper, HypothesisLanguage::Extended] {
        for noise in [Noise::NONE, slips] {
            let settings = Settings { language: language_of, noise, ..Settings::default() };
            let mut learning = Learning::new(&language(3), &settings);
            let mut last = 0;
            let all = timed(|| {
                for view in &views {
                    last = timed(|| {
                        learning.add(view);
                        black_box(learning.leading(8, 10.0));
                    });
                }
            });
            let (all, last) = (float(all) / 1e9, float(last) / 1e6);
            println!("{language_of:?}, label noise {:.2}: {all:7.2} s, {last:7.3} ms", noise.get());
        }
    }
}
