//! The evaluated beliefs as a file, for other programs that compute such measures.

use std::io::{self, BufWriter, Write as _};

use folder::{Output, WholeFile};
use serde_json::json;

use super::comparison::{EvaluatedPerspective, Hypothesis};
use super::mot;
use super::picture::{Picture, image_box};

/// The file of hypotheses.
pub(super) struct HypothesisFile {
    name: String,
    out: BufWriter<WholeFile>,
    /// That of a truth in pixels: the hypotheses are written as the CSV of the MOT Challenge. JSON lines otherwise.
    picture: Option<Picture>,
}

impl HypothesisFile {
    /// Creates the file.
    pub(super) fn create(output: &Output, picture: Option<Picture>) -> io::Result<Self> {
        let mut out = BufWriter::new(output.create_whole()?);
        if picture.is_none() {
            writeln!(out, "{}", json!({ "leo_hypotheses": 1 }))?;
        }
        Ok(Self { name: output.path().display().to_string(), out, picture })
    }

    /// Adds a frame: the hypotheses of each perspective, in the order of `perspectives`.
    pub(super) fn add(
        &mut self,
        at_ns: u64,
        perspectives: &[EvaluatedPerspective],
        hypotheses: &[Vec<Hypothesis>],
    ) -> io::Result<()> {
        let of_each = perspectives.iter().zip(hypotheses);
        if let Some(picture) = &self.picture {
            let frame = picture.frame(at_ns);
            for belief in of_each.filter(|(own, _)| own.agent == 0).flat_map(|(_, beliefs)| beliefs) {
                if let Some(size_m) = belief.size_m {
                    let place = picture.in_pixels(&image_box(belief.position_m, size_m));
                    self.out.write_all(mot::line(frame, belief.id, &place).as_bytes())?;
                }
            }
            return Ok(());
        }
        for (own, beliefs) in of_each {
            let object = |belief: &Hypothesis| json!({ "id": belief.id, "position_m": belief.position_m, "size_m": belief.size_m });
            let objects: Vec<_> = beliefs.iter().map(object).collect();
            let frame = json!({ "at_ns": at_ns, "perspective": own.perspective, "hypotheses": objects });
            writeln!(self.out, "{frame}")?;
        }
        Ok(())
    }

    /// Writes what is left, and gives the file its name.
    pub(super) fn finish(self) -> io::Result<()> {
        self.out.into_inner().map_err(io::IntoInnerError::into_error)?.finish()
    }

    /// The path, for an error.
    pub(super) fn name(&self) -> String {
        self.name.clone()
    }
}
