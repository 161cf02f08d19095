use std::collections::BTreeMap;

/// What is evaluated: in each frame the true objects, a tracker's hypotheses, and how similar each pair is.
///
/// Identities are numbers that last over the whole sequence. Those of objects and those of hypotheses are separate.
/// Each frame keeps the pairs whose similarity is above zero, and no shapes.
#[derive(Clone, Debug, Default)]
pub struct Sequence {
    pub(crate) objects: Identities,
    pub(crate) hypotheses: Identities,
    pub(crate) frames: Vec<Frame>,
}

/// Identities, numbered in the order in which they first occur.
#[derive(Clone, Debug, Default)]
pub(crate) struct Identities {
    numbers: BTreeMap<u64, usize>,
    /// In how many frames each of them is.
    pub(crate) frames: Vec<u64>,
}

/// A frame, with the numbers of the identities.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frame {
    pub(crate) objects: Vec<usize>,
    pub(crate) hypotheses: Vec<usize>,
    /// The pairs that are similar, ordered by row and column.
    pub(crate) pairs: Vec<Pair>,
}

/// An object and a hypothesis of one frame that are similar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Places in the frame's lists.
    pub(crate) row: usize,
    pub(crate) column: usize,
    /// Numbers of the identities.
    pub(crate) object: usize,
    pub(crate) hypothesis: usize,
    /// Above zero, up to one.
    pub(crate) similarity: f64,
}

/// Why a frame is not added.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// Two true objects of the frame have one identity.
    #[error("object {id} is twice in one frame: give each object an identity of its own")]
    ObjectTwice {
        /// The identity.
        id: u64,
    },
    /// Two hypotheses of the frame have one identity.
    #[error("hypothesis {id} is twice in one frame: give each hypothesis an identity of its own")]
    HypothesisTwice {
        /// The identity.
        id: u64,
    },
    /// A similarity is not from 0 to 1.
    #[error(
        "the similarity of object {object} and hypothesis {hypothesis} is {similarity}: it must be from 0 to 1"
    )]
    Similarity {
        /// The identity of the object.
        object: u64,
        /// The identity of the hypothesis.
        hypothesis: u64,
        /// The invalid similarity.
        similarity: f64,
    },
}

impl Sequence {
    /// Adds the next frame: the true objects and the hypotheses, each with its identity and its shape. `similarity`
    /// is from 0 (not similar) to 1 (equal).
    ///
    /// # Errors
    ///
    /// An identity occurs twice, or a similarity is not from 0 to 1. The sequence is unchanged.
    pub fn add<S>(
        &mut self,
        objects: &[(u64, S)],
        hypotheses: &[(u64, S)],
        similarity: impl Fn(&S, &S) -> f64,
    ) -> Result<(), FrameError> {
        if let Some(id) = repeated(objects) {
            return Err(FrameError::ObjectTwice { id });
        }
        if let Some(id) = repeated(hypotheses) {
            return Err(FrameError::HypothesisTwice { id });
        }
        let mut similar = Vec::new();
        for (row, (object, true_shape)) in objects.iter().enumerate() {
            for (column, (hypothesis, shape)) in hypotheses.iter().enumerate() {
                let similarity = similarity(true_shape, shape);
                if !(0.0..=1.0).contains(&similarity) {
                    return Err(FrameError::Similarity {
                        object: *object,
                        hypothesis: *hypothesis,
                        similarity,
                    });
                }
                if similarity > 0.0 {
                    similar.push((row, column, similarity));
                }
            }
        }
        let objects: Vec<usize> = objects.iter().map(|(id, _)| self.objects.count(*id)).collect();
        let hypotheses: Vec<usize> = hypotheses.iter().map(|(id, _)| self.hypotheses.count(*id)).collect();
        let pair = |(row, column, similarity): (usize, usize, f64)| {
            let (object, hypothesis) = (*objects.get(row)?, *hypotheses.get(column)?);
            Some(Pair { row, column, object, hypothesis, similarity })
        };
        let pairs = similar.into_iter().filter_map(pair).collect();
        self.frames.push(Frame { objects, hypotheses, pairs });
        Ok(())
    }

    /// Number of frames.
    #[must_use]
    pub fn frames(&self) -> u64 {
        quantity::number::saturating_u64(self.frames.len())
    }

    /// Number of identities of the true objects.
    #[must_use]
    pub fn objects(&self) -> u64 {
        quantity::number::saturating_u64(self.objects.frames.len())
    }

    /// Number of identities of the hypotheses.
    #[must_use]
    pub fn hypotheses(&self) -> u64 {
        quantity::number::saturating_u64(self.hypotheses.frames.len())
    }

    /// Number of true objects, summed over the frames.
    #[must_use]
    pub fn object_instances(&self) -> u64 {
        self.objects.frames.iter().sum()
    }

    /// Number of hypotheses, summed over the frames.
    #[must_use]
    pub fn hypothesis_instances(&self) -> u64 {
        self.hypotheses.frames.iter().sum()
    }
}

impl Identities {
    /// The number of an identity that is in one more frame.
    fn count(&mut self, id: u64) -> usize {
        let next = self.frames.len();
        let number = *self.numbers.entry(id).or_insert(next);
        match self.frames.get_mut(number) {
            Some(frames) => *frames += 1,
            None => self.frames.push(1),
        }
        number
    }

    /// In how many frames an identity is.
    pub(crate) fn frames_of(&self, number: usize) -> u64 {
        self.frames.get(number).copied().unwrap_or(0)
    }
}

/// An identity that occurs twice.
fn repeated<S>(instances: &[(u64, S)]) -> Option<u64> {
    let mut ids: Vec<u64> = instances.iter().map(|(id, _)| *id).collect();
    ids.sort_unstable();
    ids.windows(2).find(|pair| pair.first() == pair.last()).and_then(|pair| pair.first().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let equal = |one: &i32, other: &i32| if one == other { 1.0 } else { f64::NAN };
        let mut sequence = Sequence::default();
        let errors = [
            sequence.add(&[(1, 0), (2, 1), (1, 2)], &[], equal).unwrap_err(),
            sequence.add(&[(1, 0)], &[(7, 0), (7, 1)], equal).unwrap_err(),
            sequence.add(&[(1, 0)], &[(7, 1)], equal).unwrap_err(),
        ];
        assert_eq!(errors[0], FrameError::ObjectTwice { id: 1 });
        assert_eq!(errors[1], FrameError::HypothesisTwice { id: 7 });
        assert!(
            matches!(errors[2], FrameError::Similarity { object: 1, hypothesis: 7, .. }),
            "{:?}",
            errors[2]
        );
        assert_eq!((sequence.frames(), sequence.objects(), sequence.hypotheses()), (0, 0, 0));
        insta::assert_snapshot!(errors.map(|error| error.to_string()).join("\n"));
    }

    #[test]
    fn identities_and_their_frames_are_counted() {
        let mut sequence = Sequence::default();
        let similar = |_: &(), _: &()| 0.5;
        sequence.add(&[(9, ()), (4, ())], &[(1, ())], similar).unwrap();
        sequence.add(&[(4, ())], &[], similar).unwrap();
        assert_eq!((sequence.frames(), sequence.objects(), sequence.hypotheses()), (2, 2, 1));
        assert_eq!((sequence.object_instances(), sequence.hypothesis_instances()), (3, 1));
        assert_eq!(sequence.objects.frames, [1, 2]);
    }
}
