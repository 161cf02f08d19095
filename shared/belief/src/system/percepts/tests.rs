use std::path::Path;

use message::Feature;
use proptest::prelude::*;
use settings::number::NotNegative;

use super::file::BUILTIN;
use super::*;

/// The line of an error and what it says is wrong.
fn told(error: settings::SettingsError) -> (usize, String) {
    let settings::SettingsError::Invalid { line, reason, .. } = error else {
        panic!("{error} is of no text")
    };
    (line, reason)
}

fn refusal(from: &str, to: &str) -> (usize, String) {
    assert!(BUILTIN.contains(from), "the file no longer says {from}");
    let text = BUILTIN.replacen(from, to, 1);
    told(Percepts::parse(&text, Path::new("p.toml")).unwrap_err())
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
    let culls = [Cull::UnseenLongerThan(Duration::from_millis(600)), Cull::PlaceEmptyFor(Duration::ZERO)];
    assert_eq!(percepts.belief.cull, culls);
}

#[test]
fn an_empty_place_is_confirmed_by_one_observation_or_over_time() {
    let text = BUILTIN.replace("when = \"place_in_view_and_empty\"", "when = { place_empty_for_ms = 400.0 }");
    let percepts = Percepts::parse(&text, Path::new("p.toml")).unwrap();
    assert_eq!(percepts.belief.cull[1], Cull::PlaceEmptyFor(Duration::from_millis(400)));
}

#[test]
fn more_symbols_than_can_be_named_are_refused() {
    let red = "{ name = \"red\", at = [0.80, 0.05, 0.05] },";
    let more = |count: u32| {
        let one = |number| format!("{{ name = \"{number}\", at = [0.80, 0.05, 0.05] }},");
        (0..count).map(one).collect::<String>() + red
    };
    let text = BUILTIN.replacen(red, &more(64 - 7), 1);
    let percepts = Percepts::parse(&text, Path::new("p.toml")).unwrap();
    assert_eq!(percepts.get(5).unwrap().symbols().count(), 64);
    assert!(refusal(red, &more(64 - 6)).1.contains("65 prototypes: at most 64"));
}

#[test]
fn a_contradictory_percepts_file_is_refused_with_the_position() {
    let cases = [
        ("parent = \"position\"", "parent = \"place\"", "`place`; there are position, orientation"),
        ("percept = \"colour\"", "percept = \"color\"", "`color`"),
        ("name = \"orientation\"", "name = \"position\"", "percept named `position`"),
        ("name = \"green\"", "name = \"red\"", "prototype named `red`"),
        ("name = \"green\"", "name = \" \"", "1 to 64 bytes"),
        ("name = \"orientation\"", "name = \"a\\nb\"", "1 to 64 bytes"),
        ("measure = \"differs\"", "measure = \"metres\"", "`shape`"),
        ("weight = 0.5", "weight = -0.5", "-0.5"),
        (
            "history = { log_timescale = { samples = 64 } }",
            "history = { low_pass = { alpha = 0.5 } }",
            "symbols",
        ),
        ("at = [0.80, 0.05, 0.05]", "at = [0.80, 0.05]", "`red` has 2 numbers: its space has 3"),
        ("at = [0.80, 0.05, 0.05]", "at = [0.80, 0.05, 1.05]", "`red` has 1.05: its space has linear red"),
        ("at = [0.80, 0.05, 0.05]", "at = [0.80, -0.05, 0.05]", "`red` has -0.05"),
        ("at = [0.80, 0.05, 0.05]", "at = [0.80, nan, 0.05]", "`red` has NaN"),
        ("at = [0.80, 0.05, 0.05]", "at = [204, 13, 13]", "`red` has 204"),
        ("at = [0.80, 0.05, 0.05]", "at = \"#cc0d0\"", "`#cc0d0` is no colour"),
        ("at = [0.80, 0.05, 0.05]", "at = 0.8", "a list of numbers, or a colour"),
        ("at = [0.0, 1.0, 0.0, 0.0]", "at = [0.0, 1.5, 0.0, 0.0]", "`slab` has 1.5: its space has elongated"),
        ("at = [0.0, 1.0, 0.0, 0.0]", "at = \"#00ff00\"", "`slab` has 3 numbers: its space has 4"),
        ("at = [0.03] }", "at = [0.0] }", "`small` has 0: its space has an edge in metres"),
        ("at = [0.03] }", "at = [inf] }", "`small` has inf"),
        ("max_m = [inf, inf, inf]", "max_m = [inf, -1.0, inf]", "region"),
        ("max_m = [inf, inf, inf]", "max_m = [inf, nan, inf]", "region"),
        ("normalised = false", "normalized = false", "`normalised`?"),
        ("position_sd_m = 0.01", "position_sd_m = 0.0", "above 0"),
        ("speed_sd_m_s = 1.0", "speed_sd_m_s = 1e30", "up to 1000"),
        ("gate_sd = 3.4", "gate_sd = inf", "inf"),
        ("coast_ms = 500.0", "coast_ms = 60001.0", "at most 60 s"),
        ("contact_m = 0.02", "contact_m = -0.02", "not negative"),
    ];
    let mut wording = String::new();
    for (from, to, word) in cases {
        let (line, reason) = refusal(from, to);
        assert!(line > 1 && reason.contains(word), "{line}: {reason} does not name {word}");
        wording += &format!("{to}\n    {reason}\n");
    }
    insta::assert_snapshot!(wording);
}

#[test]
fn a_prototype_may_be_a_colour_of_srgb() {
    let text = BUILTIN.replacen("at = [0.80, 0.05, 0.05]", "at = \"#E73f0a\"", 1);
    let percepts = Percepts::parse(&text, Path::new("p.toml")).unwrap();
    let Kernel::Nearest(nearest) = &percepts.percepts[5].kernel else {
        panic!("colour is a nearest prototype")
    };
    let [red, green, blue] = nearest.prototypes[0].at[..] else { panic!("{nearest:?}") };
    assert!((red - 0.7991).abs() < 1e-4 && (green - 0.0497).abs() < 1e-4 && (blue - 0.0030).abs() < 1e-4);
}

#[test]
fn a_role_that_goals_cannot_give_is_refused() {
    let of = |name: &str, role: &str| {
        let (before, after) = BUILTIN.split_once(&format!("name = \"{name}\"")).unwrap();
        let (_, rest) = after.split_once("role = \"").unwrap();
        let (_, rest) = rest.split_once('"').unwrap();
        let text = format!("{before}name = \"{name}\"\nrole = \"{role}\"{rest}");
        // At most a `parent` line stands between the name and the role; it is not needed here.
        Percepts::parse(&text, Path::new("p.toml")).map(drop).map_err(told)
    };
    let mut wording = String::new();
    for (name, role, word) in [
        ("marked", "criteria", "`nearest`"),
        ("position", "criteria", "`nearest`"),
        ("colour", "expectation", "positions"),
        ("extents", "expectation", "positions"),
    ] {
        let (line, reason) = of(name, role).unwrap_err();
        assert!(line > 1 && reason.contains(word), "{line}: {reason}");
        wording += &format!("{name} is {role}\n    {reason}\n");
    }
    insta::assert_snapshot!(wording);
    for (name, role) in [("colour", "neither"), ("marked", "neither"), ("orientation", "expectation")] {
        assert_eq!(of(name, role), Ok(()), "{name}");
    }
}

/// The built-in percepts plus a `source` percept and a distance term for it.
fn with_source(role: &str, history: &str, measure: &str) -> Result<Percepts, (usize, String)> {
    let percept = format!(
        "[[percept]]\nname = \"seen_by\"\nrole = \"{role}\"\ndecay_per_s = 0.0\nhistory = {{ {history} }}\n\
         kernel = \"source\"\n\n[belief]"
    );
    let term =
        format!("\n[[belief.distance]]\npercept = \"seen_by\"\nmeasure = \"{measure}\"\nweight = 0.15\n");
    let text = BUILTIN.replacen("[belief]", &percept, 1) + &term;
    Percepts::parse(&text, Path::new("p.toml")).map_err(told)
}

#[test]
fn a_source_is_a_nameless_symbol_that_distinguishes_objects() {
    let lossless = "lossless = { samples = 4, when_full = \"forget_oldest\" }";
    let percepts = with_source("neither", lossless, "differs").unwrap();
    let source = percepts.index("seen_by").unwrap();
    assert_eq!(
        percepts.get(source).map(|percept| (&percept.kernel, percept.symbols().count())),
        Some((&Kernel::Source, 0))
    );
    let term = Distance { percept: source, measure: Measure::Differs, weight: 0.15 };
    assert_eq!(percepts.belief.distance.last(), Some(&term));
    let mut wording = String::new();
    for (role, history, measure, word) in [
        ("neither", lossless, "difference", "`seen_by`"),
        ("neither", "low_pass = { alpha = 0.5 }", "differs", "symbols"),
        ("criteria", lossless, "differs", "`nearest`"),
    ] {
        let (_, reason) = with_source(role, history, measure).unwrap_err();
        assert!(reason.contains(word), "{reason} does not name {word}");
        wording += &format!("{role}, {history}, {measure}\n    {reason}\n");
    }
    insta::assert_snapshot!(wording);
}

#[test]
fn a_region_includes_its_boundary_and_no_nan() {
    let region = Region { min_m: [0.0; 3], max_m: [1.0; 3] };
    assert!(region.holds([0.0, 0.5, 1.0]));
    assert!(!region.holds([0.0, 0.5, 1.1]));
    assert!(!region.holds([f32::NAN, 0.5, 0.5]));
}

#[test]
fn what_is_carried_needs_an_expected_position() {
    let (before, tracking) = BUILTIN.split_once("[belief.tracking]").unwrap();
    let (_, carrying) = tracking.split_once("[belief.carrying]").unwrap();
    let text = format!("{before}[belief.carrying]{carrying}");
    let (line, reason) = Percepts::parse(&text, Path::new("p.toml")).map_err(told).unwrap_err();
    assert_eq!(line, before.lines().count() + 1);
    insta::assert_snapshot!(reason);
}

#[test]
fn the_literal_paper_merges_without_cannot_link_infinity_or_norm() {
    let mut belief = Percepts::builtin().belief;
    belief.normalised = true;
    let settings = belief.make_literal();
    assert!(!belief.cannot_link_same_source_instant && !belief.normalised);
    assert_eq!(belief.no_term_applies, NoTermApplies::Zero);
    assert_eq!(settings[2], "normalised = false (was true)");
    assert_eq!((belief.tracking, belief.carrying), (None, None));
    assert_eq!(settings.len(), 5);
}

/// The built-in percepts plus a range below the given parent; no parent for `None`.
fn with_range(parent: Option<&str>, range: &str) -> Result<Percepts, (usize, String)> {
    let parent = parent.map(|parent| format!("parent = \"{parent}\"\n")).unwrap_or_default();
    let percept = format!(
        "[[percept]]\nname = \"r\"\n{parent}role = \"neither\"\ndecay_per_s = 0.2\n\
         history = {{ low_pass = {{ alpha = 0.5 }} }}\nkernel = {{ range = {{ {range} }} }}\n\n[belief]"
    );
    let text = BUILTIN.replacen("[belief]", &percept, 1);
    Percepts::parse(&text, Path::new("p.toml")).map_err(told)
}

fn range(parent: &str, range: &str) -> Range {
    let percepts = with_range(Some(parent), range).unwrap();
    match percepts.percepts.last().map(|percept| percept.kernel.clone()) {
        Some(Kernel::Range(range)) => range,
        other => panic!("the last percept is a range, not {other:?}"),
    }
}

#[test]
fn a_range_includes_its_limits_and_neither_values_beyond_nor_nan() {
    // In double precision, an observed 0.7 is less than 0.7, and an observed 1.1 is greater.
    let raised = range("position", "component = \"z_m\", from = 0.7, to = 1.1");
    let degree = |z| raised.degree(Feature::Vector([9.0, 9.0, z]));
    for (z, expected) in [(0.7, 1.0), (0.9, 1.0), (1.1, 1.0), (0.699, 0.0), (1.101, 0.0), (f32::NAN, 0.0)] {
        assert_eq!(degree(z), Some(expected), "{z}");
    }
    for (z, expected) in [(f32::INFINITY, 0.0), (f32::NEG_INFINITY, 0.0)] {
        assert_eq!(degree(z), Some(expected), "{z}");
    }
}

#[test]
fn the_degree_of_a_range_falls_to_zero_over_its_softness() {
    let soft = range("position", "component = \"z_m\", from = 0.25, to = 0.5, softness = 0.5");
    let degree = |z| soft.degree(Feature::Vector([0.0, 0.0, z]));
    assert_eq!([degree(0.25), degree(0.5)], [Some(1.0); 2]);
    assert_eq!([degree(0.0), degree(0.75)], [Some(0.5); 2]);
    assert_eq!([degree(-0.125), degree(0.875)], [Some(0.25); 2]);
    assert_eq!([degree(-0.25), degree(1.0), degree(f32::NAN)], [Some(0.0); 3]);
    // The better of two answers matches; half way, both match by 0.5.
    for (degree, matching) in [(0.0, 1.0), (0.25, 0.75), (0.5, 0.5), (0.75, 0.75), (1.0, 1.0)] {
        assert_eq!(Some(Range::matching(degree)), Some(matching), "{degree}");
    }
}

#[test]
fn a_range_is_of_the_number_that_it_names() {
    let place = Feature::Vector([0.3, -0.4, 1.2]);
    let extents = Feature::Vector([0.1, 0.3, 0.2]);
    for (parent, of, feature, number) in [
        ("position", "x_m", place, 0.3),
        ("position", "y_m", place, -0.4),
        ("position", "z_m", place, 1.2),
        ("position", "distance_m", place, 1.3),
        ("extents", "longest_m", extents, 0.6),
        ("extents", "shortest_m", extents, 0.2),
        ("filled", "number", Feature::Number(0.75), 0.75),
        ("left", "number", Feature::Number(1.0), 1.0),
    ] {
        let degree = |from: f64, to: f64| {
            range(parent, &format!("component = \"{of}\", from = {from}, to = {to}")).degree(feature)
        };
        assert_eq!(degree(number - 0.01, number + 0.01), Some(1.0), "{of}");
        assert_eq!(degree(number + 0.01, number + 0.02), Some(0.0), "{of}");
        assert_eq!(
            range(parent, &format!("component = \"{of}\", to = 9.0")).degree(Feature::Symbol(1)),
            None,
            "{of}"
        );
    }
}

#[test]
fn a_range_may_have_a_single_limit() {
    let high = range("position", "component = \"z_m\", from = 0.1");
    assert_eq!(high.degree(Feature::Vector([0.0, 0.0, f32::MAX])), Some(1.0));
    assert_eq!(high.degree(Feature::Vector([0.0, 0.0, 0.0])), Some(0.0));
    let near = range("position", "component = \"distance_m\", to = 0.5");
    assert_eq!(near.degree(Feature::Vector([0.0; 3])), Some(1.0));
    assert_eq!(near.degree(Feature::Vector([0.5, 0.1, 0.0])), Some(0.0));
}

#[test]
fn a_range_of_an_underived_number_is_refused_at_its_place() {
    let (line, reason) = with_range(None, "component = \"z_m\", from = 0.1").unwrap_err();
    assert!(line > 1 && reason.contains("`z_m`"), "{line}: {reason}");
    let mut wording = format!("no parent, z_m\n    {reason}\n");
    for (parent, of) in [
        ("orientation", "z_m"),
        ("colour", "number"),
        ("extents", "z_m"),
        ("extents", "number"),
        ("position", "longest_m"),
        ("position", "number"),
        ("filled", "z_m"),
        ("left", "x_m"),
    ] {
        let (_, reason) = with_range(Some(parent), &format!("component = \"{of}\", from = 0.1")).unwrap_err();
        assert!(reason.contains(&format!("`{parent}`")) && reason.contains(&format!("`{of}`")), "{reason}");
        wording += &format!("{parent}, {of}\n    {reason}\n");
    }
    insta::assert_snapshot!(wording);
}

#[test]
fn a_range_that_excludes_no_value_is_refused() {
    let mut wording = String::new();
    for (limits, word) in [
        ("", "limits"),
        (", softness = 0.1", "limits"),
        (", from = 0.2, to = 0.2", "from 0.2 to 0.2"),
        (", from = 0.3, to = 0.2", "from 0.3 to 0.2"),
        (", from = nan", "`from` is NaN"),
        (", from = 0.1, to = inf", "`to` is inf"),
        (", from = 0.1, softness = -0.1", "-0.1"),
        (", from = 0.1, softness = nan", "NaN"),
        (", from = 0.1, upto = 0.2", "`upto`"),
    ] {
        let (line, reason) =
            with_range(Some("position"), &format!("component = \"z_m\"{limits}")).unwrap_err();
        assert!(line > 1 && reason.contains(word), "{limits}: {line}: {reason}");
        wording += &format!("{limits}\n    {reason}\n");
    }
    let (_, reason) = with_range(Some("position"), "component = \"height\", from = 0.1").unwrap_err();
    assert!(reason.contains("`height`") && reason.contains("`x_m`"), "{reason}");
    insta::assert_snapshot!(wording);
}

#[test]
fn every_component_has_the_name_of_the_file_format() {
    for (parent, of) in [
        ("position", Component::XM),
        ("position", Component::YM),
        ("position", Component::ZM),
        ("position", Component::DistanceM),
        ("extents", Component::LongestM),
        ("extents", Component::ShortestM),
        ("on", Component::Number),
    ] {
        assert_eq!(range(parent, &format!("component = \"{}\", to = 1.0", of.name())).component, of);
    }
}

#[test]
fn degrees_of_a_range_are_compared_by_their_difference() {
    let percepts = with_range(Some("position"), "component = \"z_m\", from = 0.1").unwrap();
    let term = |measure: &str| {
        let text = BUILTIN.replacen("measure = \"differs\"", &format!("measure = \"{measure}\""), 1);
        let range = "[[percept]]\nname = \"r\"\nparent = \"position\"\nrole = \"neither\"\n\
                     decay_per_s = 0.2\nhistory = { low_pass = { alpha = 0.5 } }\n\
                     kernel = { range = { component = \"z_m\", from = 0.1 } }\n\n[belief]";
        let text = text.replacen("[belief]", range, 1).replacen("percept = \"shape\"", "percept = \"r\"", 1);
        Percepts::parse(&text, Path::new("p.toml"))
    };
    assert_eq!(percepts.get(11).unwrap().parent, Some(0));
    assert!(term("difference").is_ok());
    assert!(told(term("metres").unwrap_err()).1.contains("`r`"));
}

#[test]
fn a_range_reads_its_first_ancestor_that_is_not_a_range() {
    let percepts = with_range(Some("left"), "component = \"number\", from = 0.5").unwrap();
    let all = &percepts.percepts;
    assert_eq!(origin(all, all.last().unwrap()).name, "left");
    assert_eq!(origin(all, &all[3]).name, "size");
}

proptest! {
    #[test]
    fn the_degree_of_a_range_never_rises_with_distance_from_it(
        from in -2.0..2.0_f64,
        width in 0.001..2.0_f64,
        softness in prop_oneof![Just(0.0), 0.0..1.0_f64],
        limits in 0..3_u8,
        mut numbers in prop::collection::vec(-6.0..6.0_f32, 2..20),
    ) {
        let range = Range {
            component: Component::Number,
            from: (limits != 1).then_some(from),
            to: (limits != 2).then_some(from + width),
            softness: NotNegative::try_from(softness).ok(),
        };
        numbers.sort_by(f32::total_cmp);
        let degree = |number: f32| range.degree(Feature::Number(number)).unwrap();
        let degrees: Vec<f32> = numbers.iter().map(|number| degree(*number)).collect();
        for degree in &degrees {
            prop_assert!((0.0..=1.0).contains(degree));
            prop_assert!((0.5..=1.0).contains(&Range::matching(*degree)));
        }
        let middle = numbers.partition_point(|number| f64::from(*number) < from + width / 2.0);
        let (below, above) = degrees.split_at(middle);
        prop_assert!(limits == 1 || below.is_sorted(), "{below:?}");
        prop_assert!(limits == 2 || above.is_sorted_by(|a, b| a >= b), "{above:?}");
        prop_assert!(limits != 1 || below.iter().all(|degree| *degree >= 1.0));
        prop_assert!(limits != 2 || above.iter().all(|degree| *degree >= 1.0));
    }
}
