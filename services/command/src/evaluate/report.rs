//! The measures as a table for people and as JSON for programs.

use std::fmt::Write as _;

use config::Names;
use evaluation::{ClearMot, Hota, Identity};
use quantity::number::{counted, saturating_u32};
use reports::beliefs::{Refusal, perspective_name};
use reports::text_table::{Align, TextTable};
use serde_json::{Value, json};

use super::comparison::{EvaluatedPerspective, Similarity};
use crate::trace_quality::Instants;

/// The threshold that the field uses. At the cut-off of a distance the similarity is the same.
const THRESHOLD: f64 = 0.5;

/// What is reported beside the measures.
#[derive(Clone, Debug, Default)]
pub(super) struct Summary {
    /// Frames of the truth.
    pub(super) frames: u64,
    /// Those of them whose instant is not in the trace.
    pub(super) without_instant: u64,
    /// Instants of the trace without a truth.
    pub(super) without_truth: u64,
    pub(super) observations: u64,
    /// Observations without room.
    pub(super) left_out: u64,
    /// Observations that were refused, for each reason, and the place of the first.
    pub(super) refused: Vec<Refusal>,
    /// The instants of the trace.
    pub(super) instants: Instants,
    pub(super) cut_short: bool,
    /// Agents that the truth names and that have no perspective.
    pub(super) not_simulated: Vec<u16>,
    /// Of a truth in pixels.
    pub(super) metres_per_pixel: Option<f64>,
    pub(super) remembered: bool,
}

/// The measures of one perspective.
struct Measures<'a> {
    own: &'a EvaluatedPerspective,
    name: String,
    clear: ClearMot,
    identity: Identity,
    hota: Hota,
}

/// The report of an evaluation.
pub(super) struct Report<'a> {
    similarity: Similarity,
    summary: &'a Summary,
    perspectives: Vec<Measures<'a>>,
}

impl<'a> Report<'a> {
    /// Computes the measures.
    pub(super) fn of(
        perspectives: &'a [EvaluatedPerspective],
        similarity: Similarity,
        summary: &'a Summary,
        names: &Names,
    ) -> Self {
        let measures = |own: &'a EvaluatedPerspective| {
            let path: &[u16] = if own.agent == 0 { &[] } else { &[own.agent] };
            Measures {
                own,
                name: perspective_name(names, path),
                clear: own.sequence.clear_mot(THRESHOLD),
                identity: own.sequence.identity(THRESHOLD),
                hota: own.sequence.hota(),
            }
        };
        Self { similarity, summary, perspectives: perspectives.iter().map(measures).collect() }
    }

    /// The table.
    pub(super) fn to_text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let counts =
            if self.summary.remembered { "every remembered belief" } else { "beliefs observed in the frame" };
        let paired = match self.similarity {
            Similarity::Box => "box IoU of 0.5 or more".to_owned(),
            Similarity::Distance { cut_off_m } => format!("distance of {cut_off_m} m or less"),
        };
        writeln!(out, "hypotheses: {counts}; a match: {paired}\n")?;
        let mut ratios_table =
            measures_table(["MOTA", "MOTP", "IDF1", "IDP", "IDR", "HOTA", "DetA", "AssA", "LocA"]);
        for Measures { name, clear, identity, hota, .. } in &self.perspectives {
            let ratios = [
                clear.mota(),
                clear.motp(),
                identity.idf1(),
                identity.idp(),
                identity.idr(),
                hota.hota(),
                hota.det_a(),
                hota.ass_a(),
                hota.loc_a(),
            ];
            let ratios =
                ratios.map(|ratio| ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.4}")));
            ratios_table.add(std::iter::once(name.clone()).chain(ratios));
        }
        writeln!(out, "{}", ratios_table.to_text())?;
        let mut counts_table =
            measures_table(["objects", "MT", "PT", "ML", "TP", "FN", "FP", "IDSW", "Frag"]);
        for Measures { own, name, clear, .. } in &self.perspectives {
            let counts = [
                own.sequence.objects(),
                clear.mostly_tracked,
                clear.partly_tracked,
                clear.mostly_lost,
                clear.matches,
                clear.misses,
                clear.false_positives,
                clear.identity_switches,
                clear.fragmentations,
            ];
            counts_table.add(std::iter::once(name.clone()).chain(counts.map(|count| count.to_string())));
        }
        write!(out, "{}", counts_table.to_text())?;
        self.write_summary(out)
    }

    fn write_summary(&self, out: &mut String) -> std::fmt::Result {
        let Summary { frames, observations, without_instant, without_truth, left_out, .. } = self.summary;
        let of_truth = |number| format!("{} of the truth", number_of(number, "frame"));
        writeln!(out, "\n{}, {}", of_truth(*frames), number_of(*observations, "observation"))?;
        if let Some(scale) = self.summary.metres_per_pixel {
            writeln!(out, "a pixel is {scale:.5} m")?;
        }
        if let Similarity::Distance { cut_off_m } = self.similarity {
            for Measures { name, clear, .. } in &self.perspectives {
                if let Some(motp) = clear.motp() {
                    writeln!(
                        out,
                        "{name}: the matches are {:.4} m apart on average",
                        apart_m(motp, cut_off_m)
                    )?;
                }
            }
        }
        if *without_instant > 0 {
            writeln!(
                out,
                "{} without an instant in the trace: all objects missed",
                of_truth(*without_instant)
            )?;
        }
        if *without_truth > 0 {
            let instants = number_of(*without_truth, "instant");
            writeln!(out, "{instants} of the trace without a truth: not evaluated")?;
        }
        if *left_out > 0 {
            let observations = number_of(*left_out, "observation");
            writeln!(out, "{observations} without room: raise `buffers.max_objects` in leo.toml")?;
        }
        for Refusal { reason, observations, first } in &self.summary.refused {
            let observations = number_of(*observations, "observation");
            writeln!(out, "{observations} refused: {reason} (the first: {first})")?;
        }
        if self.summary.cut_short {
            writeln!(out, "the trace ends in the middle of a frame")?;
        }
        if let Some(most) = self.summary.not_simulated.iter().max() {
            let agents = counted(saturating_u32(self.summary.not_simulated.len()), "agent");
            writeln!(out, "{agents} of the truth without a perspective: say --partners {most}")?;
        }
        Ok(())
    }

    /// The JSON document. A ratio without a denominator is null.
    pub(super) fn to_json(&self) -> Value {
        let Summary { frames, without_instant, without_truth, observations, left_out, .. } = self.summary;
        let similarity = match self.similarity {
            Similarity::Box => json!({ "kind": "box_iou", "threshold": THRESHOLD }),
            Similarity::Distance { cut_off_m } => json!({ "kind": "distance", "cut_off_m": cut_off_m }),
        };
        json!({
            "similarity": similarity,
            "remembered": self.summary.remembered,
            "metres_per_pixel": self.summary.metres_per_pixel,
            "frames": frames,
            "frames_without_instant": without_instant,
            "instants_without_truth": without_truth,
            "observations": observations,
            "left_out": left_out,
            "refused": self.summary.refused,
            "cut_short": self.summary.cut_short,
            "not_simulated": self.summary.not_simulated,
            "perspectives": self.perspectives.iter().map(|own| own.to_json(self.similarity)).collect::<Vec<_>>(),
        })
    }
}

impl Measures<'_> {
    fn to_json(&self, similarity: Similarity) -> Value {
        let Self { own, clear, identity, hota, .. } = self;
        let motp_m = match similarity {
            Similarity::Box => None,
            Similarity::Distance { cut_off_m } => clear.motp().map(|motp| apart_m(motp, cut_off_m)),
        };
        json!({
            "perspective": own.perspective,
            "agent": own.agent,
            "objects": own.sequence.objects(),
            "hypotheses": own.sequence.hypotheses(),
            "object_instances": own.sequence.object_instances(),
            "hypothesis_instances": own.sequence.hypothesis_instances(),
            "clear_mot": {
                "mota": clear.mota(),
                "motp": clear.motp(),
                "motp_m": motp_m,
                "recall": clear.recall(),
                "precision": clear.precision(),
                "matches": clear.matches,
                "misses": clear.misses,
                "false_positives": clear.false_positives,
                "identity_switches": clear.identity_switches,
                "fragmentations": clear.fragmentations,
                "mostly_tracked": clear.mostly_tracked,
                "partly_tracked": clear.partly_tracked,
                "mostly_lost": clear.mostly_lost,
            },
            "identity": {
                "idf1": identity.idf1(),
                "idp": identity.idp(),
                "idr": identity.idr(),
                "true_positives": identity.true_positives,
                "false_positives": identity.false_positives,
                "false_negatives": identity.false_negatives,
            },
            "hota": {
                "hota": hota.hota(),
                "det_a": hota.det_a(),
                "ass_a": hota.ass_a(),
                "loc_a": hota.loc_a(),
            },
        })
    }
}

/// A number with its noun.
/// A table with a row for each perspective, and a column for each measure.
fn measures_table(measures: [&str; 9]) -> TextTable {
    let perspective = ("", Align::Left);
    let columns: Vec<_> =
        std::iter::once(perspective).chain(measures.map(|name| (name, Align::Right))).collect();
    TextTable::new(&columns)
}

fn number_of(number: u64, noun: &str) -> String {
    counted(u32::try_from(number).unwrap_or(u32::MAX), noun)
}

/// The mean distance of matches, from their mean similarity.
fn apart_m(similarity: f64, cut_off_m: f64) -> f64 {
    (1.0 - similarity) * 2.0 * cut_off_m
}
