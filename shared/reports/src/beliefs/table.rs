//! The beliefs at one instant as a table for people.

use std::fmt::{self, Write as _};

use clock::Instant;
use config::Names;
use message::{Belief, Difference, NOBODY};
use quantity::number::{counted, counted_with, saturating_u32};

use super::perspective_record::PerspectiveRecord;
use super::phrases::{PerceptPhrases, place};
use super::summary::{Refusal, Summary};

/// Writes the final beliefs of every perspective, its differences from the robot's, and the summary.
pub(crate) fn write(
    words: &PerceptPhrases,
    minds: &[PerspectiveRecord<'_>],
    summary: &Summary,
    out: &mut String,
) -> fmt::Result {
    if let (Some(first), Some(last)) = (summary.first_at_ns, summary.last_at_ns) {
        let since = Instant::from_nanos(last).since(Instant::from_nanos(first)).as_secs_f64();
        writeln!(out, "\nWhat is believed at the end, at {since:.2} s\n")?;
        for mind in minds {
            write_mind(words, mind, out)?;
        }
        writeln!(out)?;
    }
    write_summary(words.names(), summary, out)
}

/// A belief in words, without its identity.
pub(crate) fn describe(words: &PerceptPhrases, mind: &PerspectiveRecord<'_>, belief: &Belief) -> String {
    let mut parts = vec![words.thing(belief)];
    if let Some(place_m) = mind.place_m(belief, words.position) {
        parts.push(format!("at {}", place(place_m)));
    }
    let mut text = parts.join(" ");
    for state in words.states().iter().filter_map(|percept| words.state(*percept, belief)) {
        text += &format!(", {state}");
    }
    if belief.held_by != NOBODY {
        text += &format!(", held by {}", words.names().of(belief.held_by));
    }
    text
}

fn write_mind(words: &PerceptPhrases, mind: &PerspectiveRecord<'_>, out: &mut String) -> fmt::Result {
    let (head, name) = (mind.head, mind.name(words.names()));
    if mind.was_never_observed() {
        return writeln!(out, "{name} was never there");
    }
    let things = match mind.beliefs.len() {
        0 => "believes in nothing".to_owned(),
        count => format!("believes in {}", counted(saturating_u32(count), "thing")),
    };
    let away = if head.present == 0 { " (away)" } else { "" };
    writeln!(out, "{name}{away} {things}")?;
    for belief in mind.beliefs {
        let age =
            Instant::from_nanos(head.header.valid_at_ns).since(Instant::from_nanos(belief.perceived_at_ns));
        let Belief { id, observations, .. } = belief;
        let text = describe(words, mind, belief);
        writeln!(
            out,
            "  {id:>4}  {text:<56} {:>12}, {:.2} s ago",
            counted(*observations, "time"),
            age.as_secs_f64()
        )?;
    }
    if head.overflowed > 0 {
        let count = head.overflowed;
        let count =
            counted_with(count, "observation, belief or occluder", "observations, beliefs or occluders");
        writeln!(
            out,
            "  {count} did not fit: raise buffers.max_objects in leo.toml, or \
             occluders.max_count in perspective.toml"
        )?;
    }
    if head.refused > 0 {
        let count =
            counted_with(head.refused, "observation or evaluation was", "observations or evaluations were");
        writeln!(out, "  {count} refused: invalid, too old, or too new")?;
    }
    if head.perspective != 0 {
        for difference in mind.differences {
            write_difference(words, &name, difference, out)?;
        }
        if mind.differences.is_empty() {
            writeln!(out, "  and differs from Leo in nothing")?;
        }
    }
    Ok(())
}

fn write_difference(
    words: &PerceptPhrases,
    who: &str,
    difference: &Difference,
    out: &mut String,
) -> fmt::Result {
    match (difference.one(), difference.other()) {
        (Some(robots), None) => writeln!(out, "  only Leo believes in Leo's {robots}"),
        (None, Some(his)) => writeln!(out, "  only {who} believes in {his}"),
        (Some(robots), Some(his)) => {
            writeln!(out, "  {his}, which is Leo's {robots}, differs:")?;
            for aspect in difference.aspects() {
                let name = words.name(aspect.percept);
                let [own, his] =
                    [aspect.one(), aspect.other()].map(|feature| words.feature(aspect.percept, feature));
                writeln!(out, "        {name:<12} {own} for Leo, {his} for {who}")?;
            }
            Ok(())
        }
        (None, None) => Ok(()),
    }
}

fn write_summary(names: &Names, summary: &Summary, out: &mut String) -> fmt::Result {
    let Summary { frames, earlier, observations, refused, left_out, cut_short, not_simulated, .. } = summary;
    writeln!(out, "{}, {}", counted(*frames, "frame"), counted(*observations, "observation"))?;
    for refusal in refused {
        let Refusal { reason, observations, first } = refusal;
        writeln!(out, "{} refused: {reason} (the first: {first})", counted(*observations, "observation"))?;
    }
    if *earlier > 0 {
        writeln!(
            out,
            "{} earlier than a previous one, at whose time they count: time never runs backwards",
            counted_with(*earlier, "frame is", "frames are")
        )?;
    }
    if *left_out > 0 {
        let left_out = counted(*left_out, "observation");
        writeln!(out, "{left_out} did not fit: raise buffers.max_objects in leo.toml")?;
    }
    if let Some(max) = not_simulated.last() {
        let partners: Vec<String> = not_simulated.iter().map(|partner| names.of(*partner)).collect();
        let partners = partners.join(", ");
        writeln!(
            out,
            "observed, and not simulated: {partners}; to simulate their beliefs too, give --partners {max}"
        )?;
    }
    if *cut_short {
        writeln!(out, "the trace ends in the middle of a frame: it was read up to there")?;
    }
    Ok(())
}
