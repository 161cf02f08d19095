//! The beliefs at one instant as a table for people.

use std::fmt::{self, Write as _};

use clock::Instant;
use message::{Belief, BeliefHead, Difference, NOBODY};

use crate::words::{PerceptPhrases, agent_name, perspective_name, place};
use crate::{PerspectiveRecord, Summary};

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
    write_summary(summary, out)
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
        text += &format!(", held by {}", agent_name(belief.held_by));
    }
    text
}

fn write_mind(words: &PerceptPhrases, mind: &PerspectiveRecord<'_>, out: &mut String) -> fmt::Result {
    let head = mind.head;
    if mind.was_never_observed() {
        return writeln!(out, "{} was never there", perspective_name(head));
    }
    let things = match mind.beliefs.len() {
        0 => "believes in nothing".to_owned(),
        1 => "believes in 1 thing".to_owned(),
        count => format!("believes in {count} things"),
    };
    let away = if head.present == 0 { " (away)" } else { "" };
    writeln!(out, "{}{away} {things}", perspective_name(head))?;
    for belief in mind.beliefs {
        let age =
            Instant::from_nanos(head.header.valid_at_ns).since(Instant::from_nanos(belief.perceived_at_ns));
        let Belief { id, observations, .. } = belief;
        let text = describe(words, mind, belief);
        writeln!(out, "  {id:>4}  {text:<56} {observations:>6} times, {:.2} s ago", age.as_secs_f64())?;
    }
    if head.overflowed > 0 {
        let count = head.overflowed;
        writeln!(
            out,
            "  {count} observations, beliefs or occluders did not fit: raise buffers.max_objects in leo.toml, or \
             occluders.max_count in perspective.toml"
        )?;
    }
    if head.refused > 0 {
        let count = head.refused;
        writeln!(out, "  {count} observations or evaluations were refused: invalid, too old, or too new")?;
    }
    if head.perspective != 0 {
        for difference in mind.differences {
            write_difference(words, head, difference, out)?;
        }
        if mind.differences.is_empty() {
            writeln!(out, "  and differs from Leo in nothing")?;
        }
    }
    Ok(())
}

fn write_difference(
    words: &PerceptPhrases,
    head: &BeliefHead,
    difference: &Difference,
    out: &mut String,
) -> fmt::Result {
    let who = perspective_name(head);
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

fn write_summary(summary: &Summary, out: &mut String) -> fmt::Result {
    let Summary { frames, earlier, observations, refused, left_out, cut_short, not_simulated, .. } = summary;
    writeln!(out, "{frames} frames, {observations} observations")?;
    for refusal in refused {
        let crate::Refusal { reason, observations, first } = refusal;
        writeln!(out, "{observations} observations refused: {reason} (the first: {first})")?;
    }
    if *earlier > 0 {
        writeln!(
            out,
            "{earlier} frames are earlier than a previous one, and take its time: time never runs backwards"
        )?;
    }
    if *left_out > 0 {
        writeln!(out, "{left_out} observations did not fit: raise buffers.max_objects in leo.toml")?;
    }
    if let Some(max) = not_simulated.last() {
        let partners: Vec<String> = not_simulated.iter().map(|partner| agent_name(*partner)).collect();
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
