use std::fmt;

use message::{Bytes as _, Kind, Layout, Number, Text, TopicId};

use crate::Frame;

/// The first field in which two frames of one topic differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The field, such as `entries[3].percepts[0].confidence`.
    pub field: String,
    /// Value in the first frame.
    pub one: String,
    /// Value in the second frame.
    pub other: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: recorded {}, replayed {}", self.field, self.one, self.other)
    }
}

impl Difference {
    /// The difference for a frame that is missing on one side.
    #[must_use]
    pub fn missing_frame(is_in_one: bool) -> Self {
        let said = |is_there| if is_there { "there" } else { "not there" }.to_owned();
        Self { field: "the frame".to_owned(), one: said(is_in_one), other: said(!is_in_one) }
    }

    /// Compares two frames of one topic bit by bit; `None` if they are equal.
    #[must_use]
    pub fn between(one: &Frame, other: &Frame) -> Option<Self> {
        if one.bytes == other.bytes {
            return None;
        }
        Some(within(one.topic, &one.bytes, &other.bytes).unwrap_or_else(|| Self {
            field: "bytes that belong to no field".to_owned(),
            one: format!("{} bytes", one.bytes.len()),
            other: format!("{} bytes", other.bytes.len()),
        }))
    }
}

fn within(topic: TopicId, one: &[u8], other: &[u8]) -> Option<Difference> {
    let [head, entry] = topic.frame_kinds();
    if let Some(found) = compare(&head, "", one, other) {
        return Some(found);
    }
    let (size, head) = (entry.size().max(1), head.size());
    let entries = |bytes: &[u8]| bytes.len().saturating_sub(head) / size;
    let both = entries(one).min(entries(other));
    let tail = |bytes: &'_ [u8], index: usize| bytes.get(head + index * size..).unwrap_or(&[]).to_vec();
    for index in 0..both {
        let found = compare(&entry, &format!("entries[{index}]"), &tail(one, index), &tail(other, index));
        if found.is_some() {
            return found;
        }
    }
    (entries(one) != entries(other)).then(|| Difference {
        field: "entries".to_owned(),
        one: entries(one).to_string(),
        other: entries(other).to_string(),
    })
}

/// Compares two values of the same kind at the start of both slices.
fn compare(kind: &Kind, path: &str, one: &[u8], other: &[u8]) -> Option<Difference> {
    let (first, second) = (one.get(..kind.size())?, other.get(..kind.size())?);
    if first == second {
        return None;
    }
    match kind {
        Kind::Number(number) => Some(Difference {
            field: path.to_owned(),
            one: value(*number, first),
            other: value(*number, second),
        }),
        Kind::Array(entry, length) => (0..*length).find_map(|index| {
            let from = index * entry.size();
            compare(entry, &format!("{path}[{index}]"), first.get(from..)?, second.get(from..)?)
        }),
        Kind::Struct(layout) if is_text(layout) => {
            let said = |bytes| format!("{:?}", Text::get(bytes).as_str());
            (said(first) != said(second)).then(|| Difference {
                field: path.to_owned(),
                one: said(first),
                other: said(second),
            })
        }
        Kind::Struct(layout) => layout.fields.iter().find_map(|field| {
            let dot = if path.is_empty() { "" } else { "." };
            let path = format!("{path}{dot}{}", field.name);
            compare(&field.kind, &path, first.get(field.offset..)?, second.get(field.offset..)?)
        }),
    }
}

fn is_text(layout: &Layout) -> bool {
    layout.name.starts_with("leo/Text/")
}

/// A number as text. Floating-point numbers include their bits, since different ones may print alike.
fn value(number: Number, bytes: &[u8]) -> String {
    match number {
        Number::U8 => u8::get(bytes).to_string(),
        Number::U16 => u16::get(bytes).to_string(),
        Number::U32 => u32::get(bytes).to_string(),
        Number::U64 => u64::get(bytes).to_string(),
        Number::F32 => format!("{} ({:#010x})", f32::get(bytes), u32::get(bytes)),
        Number::F64 => format!("{} ({:#018x})", f64::get(bytes), u64::get(bytes)),
    }
}

#[cfg(test)]
mod tests {
    use message::{Belief, BeliefHead, Beliefs, Event, EventKind, Events, Feature, Header, Remembered};

    use super::*;

    fn believed(confidence: f32, ids: &[u64]) -> Frame {
        let entries: Vec<Belief> = ids
            .iter()
            .map(|id| {
                let mut belief = Belief::new(*id, 1, 2, 3, 0);
                belief.push(Remembered::new(0, 2, 1.0, 1.0, Feature::None));
                belief.push(Remembered::new(3, 2, 1.0, confidence, Feature::Number(0.5)));
                belief
            })
            .collect();
        Frame::of::<Beliefs>(TopicId::Beliefs(0), &BeliefHead::of(0, Header::at(5)), &entries)
    }

    #[test]
    fn the_first_field_that_differs_is_named_with_both_values() {
        let found = |one, other| Difference::between(&one, &other).map(|found| found.to_string());
        assert_eq!(found(believed(0.5, &[1]), believed(0.5, &[1])), None);
        assert_eq!(
            found(believed(0.5, &[1]), believed(0.25, &[1])).unwrap(),
            "entries[0].percepts[1].confidence: recorded 0.5 (0x3f000000), replayed 0.25 (0x3e800000)"
        );
        assert_eq!(
            found(believed(0.5, &[1, 2]), believed(0.5, &[1, 3])).unwrap(),
            "entries[1].id: recorded 2, replayed 3"
        );
        assert_eq!(
            found(believed(0.5, &[1, 2]), believed(0.5, &[1])).unwrap(),
            "entries: recorded 2, replayed 1"
        );
        let said = |text| {
            let event = Event::new(EventKind::Said, "", text);
            Frame::of::<Events>(TopicId::Events, &Header::at(1), &[event])
        };
        assert_eq!(
            found(said("yes"), said("no")).unwrap(),
            "entries[0].text: recorded \"yes\", replayed \"no\""
        );
    }

    #[test]
    fn every_changed_byte_of_a_frame_is_detected() {
        let right = believed(0.5, &[1, 2]);
        for place in 0..right.bytes.len() {
            let mut wrong = right.clone();
            wrong.bytes[place] ^= 0x10;
            assert!(Difference::between(&right, &wrong).is_some(), "{place}");
        }
    }
}
