use super::*;

fn refusal(from: &str, to: &str) -> String {
    assert!(BUILTIN.contains(from), "the file no longer says {from}");
    let text = BUILTIN.replacen(from, to, 1);
    Percepts::parse(&text, Path::new("p.toml")).unwrap_err().to_string()
}

#[test]
fn the_built_in_percepts_are_sound_and_numbered_in_order() {
    let percepts = Percepts::builtin();
    assert_eq!(percepts.index("position"), Some(0));
    assert_eq!(percepts.index("colour"), Some(5));
    assert_eq!(percepts.index("smell"), None);
    let colour = percepts.get(5).unwrap();
    assert_eq!(colour.symbols().nth(2), Some("blue"));
    assert_eq!(percepts.get(10).unwrap().parent, Some(0));
    assert_eq!(percepts.belief.distance.len(), 3);
    assert_eq!(percepts.belief.cull.len(), 2);
}

#[test]
fn a_name_that_is_meant_and_not_given_is_refused_where_it_stands() {
    let said = refusal("parent = \"position\"", "parent = \"place\"");
    assert!(said.contains("no percept above is named `place`; there are position, orientation"), "{said}");
    assert!(!said.starts_with("p.toml:1:"), "{said}");
    let said = refusal("percept = \"colour\"", "percept = \"color\"");
    assert!(said.contains("no percept above is named `color`"), "{said}");
}

#[test]
fn a_name_that_is_given_twice_is_refused() {
    let said = refusal("name = \"orientation\"", "name = \"position\"");
    assert!(said.contains("a second percept named `position`"), "{said}");
    let said = refusal("name = \"green\"", "name = \"red\"");
    assert!(said.contains("a second prototype named `red`"), "{said}");
}

#[test]
fn a_measure_that_does_not_fit_is_refused() {
    let said = refusal("measure = \"differs\"", "measure = \"metres\"");
    assert!(said.contains("does not fit what `shape` derives"), "{said}");
}

#[test]
fn a_negative_weight_is_refused() {
    let said = refusal("weight = 0.5", "weight = -0.5");
    assert!(said.contains("-0.5 is out of range"), "{said}");
}

#[test]
fn symbols_are_not_filtered() {
    let said =
        refusal("history = { log_timescale = { samples = 64 } }", "history = { low_pass = { share = 0.5 } }");
    assert!(said.contains("symbols cannot be filtered"), "{said}");
}

#[test]
fn a_prototype_out_of_its_space_is_refused() {
    let said = refusal("at = [0.80, 0.05, 0.05]", "at = [0.80, 0.05]");
    assert!(said.contains("prototype `red` has 2 numbers: its space has 3"), "{said}");
}

#[test]
fn an_empty_region_is_refused() {
    let said = refusal("maximum_m = [inf, inf, inf]", "maximum_m = [inf, -1.0, inf]");
    assert!(said.contains("an empty region"), "{said}");
    let said = refusal("maximum_m = [inf, inf, inf]", "maximum_m = [inf, nan, inf]");
    assert!(said.contains("an empty region"), "{said}");
}

#[test]
fn an_unknown_key_gets_the_right_one_suggested() {
    let said = refusal("normalised = false", "normalized = false");
    assert!(said.ends_with("did you mean `normalised`?"), "{said}");
}

#[test]
fn a_region_holds_its_sides_and_no_nan() {
    let region = Region { minimum_m: [0.0; 3], maximum_m: [1.0; 3] };
    assert!(region.holds([0.0, 0.5, 1.0]));
    assert!(!region.holds([0.0, 0.5, 1.1]));
    assert!(!region.holds([f32::NAN, 0.5, 0.5]));
}

#[test]
fn taken_at_its_word_the_paper_merges_without_cannot_link_infinity_or_norm() {
    let mut belief = Percepts::builtin().belief;
    belief.normalised = true;
    let settings = belief.make_literal();
    assert!(!belief.cannot_link_same_source_instant && !belief.normalised);
    assert_eq!(belief.no_term_applies, NoTermApplies::Zero);
    assert_eq!(settings[2], "normalised = false (was true)");
    assert_eq!(settings.len(), 3);
}
