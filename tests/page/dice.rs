//! Random requests and bytes of an untrusted page, reproducible.

use serde_json::{Value, json};

/// All requests of a page.
pub(crate) const WISHES: [&str; 19] = [
    "say", "take", "carry", "put", "cancel", "seat", "leave", "return", "screen", "add", "remove", "clear",
    "lay", "open", "play", "undo", "save", "record", "keep",
];

/// Maximum length of a frame's header: opcode, length and mask.
const HEAD: usize = 8;

/// A small pseudo-random generator (xorshift), reproducible.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn roll(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.roll() % u64::try_from(end).expect("small")).expect("small")
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.roll().to_le_bytes()[0]
    }

    /// Mostly a coordinate on the table, sometimes a huge or tiny one.
    fn metres(&mut self) -> f64 {
        let share = f64::from(u16::try_from(self.roll() % 60_000).expect("small")) / 60_000.0 - 0.5;
        share * [2.0, 2.0, 2.0, 250.0, 1e300, 1e-300][self.below(6)]
    }

    /// Mostly a known word, sometimes random or too many characters.
    fn word(&mut self, known: &[&str]) -> String {
        match self.below(8) {
            0 => (0..self.below(40)).filter_map(|_| char::from_u32(self.byte().into())).collect(),
            1 => "\u{1f916}".repeat(self.below(120)),
            _ => known[self.below(known.len())].to_owned(),
        }
    }

    /// Well-formed fields of a request, with random values.
    pub(crate) fn fields(&mut self, wish: &str) -> Value {
        const THINGS: [&str; 5] = ["red square", "blue square", "peg 1", "wood peg", "wall"];
        let mut at = || [self.metres(), self.metres(), self.metres()];
        let mut fields = match wish {
            "carry" | "put" => json!({ "at": at() }),
            "seat" => json!({ "eyes": at(), "looks_at": at() }),
            "screen" => json!({ "at": at(), "half": at(), "name": self.word(&THINGS) }),
            "add" => {
                let [x, y, _] = at();
                let (kind, colour) = (self.word(&["square", "peg"]), self.word(&["red", "blue", "wood"]));
                json!({ "at": [x, y], "kind": kind, "colour": colour })
            }
            "say" => {
                json!({ "text": self.word(&["Leo, I can teach you to do task 1", "task 1 is done", "why?", "stop"]) })
            }
            "take" | "remove" => json!({ "thing": self.word(&THINGS) }),
            "lay" => json!({ "table": self.roll() >> self.below(64) }),
            "open" => json!({ "lesson": self.word(&["task1", "task2", "two_teachers", ""]) }),
            "save" => json!({ "title": self.word(&["By hand", "Task 1", "../.."]) }),
            "record" => json!({ "on": self.below(2) == 0 }),
            _ => json!({}),
        };
        if matches!(wish, "carry" | "put" | "add") && self.below(2) == 0 {
            fields["heading"] = json!(self.metres());
        }
        if matches!(wish, "say" | "take" | "seat" | "leave" | "return" | "screen" | "undo") {
            fields["teacher"] =
                [json!(1), json!(1), json!(2), json!(0), json!(65535), Value::Null][self.below(6)].clone();
        }
        fields
    }

    /// Mutates some bytes. In half of the frames it also inserts or removes bytes, or mutates the header.
    pub(crate) fn mutate(&mut self, frame: &mut Vec<u8>) {
        let is_kept = self.below(2) == 0;
        for _ in 0..=self.below(3) {
            let first = if is_kept { HEAD } else { 0 };
            let end = if is_kept || self.below(2) == 0 { frame.len() } else { HEAD };
            let at = first + self.below(end.min(frame.len()) - first);
            match self.below(if is_kept { 2 } else { 4 }) {
                0 => frame[at] ^= 1 << self.below(7),
                1 => frame[at] = self.byte(),
                2 => frame.insert(at, self.byte()),
                _ => drop(frame.remove(at)),
            }
        }
    }
}

/// A text frame as a client sends it.
pub(crate) fn frame(text: &str, mask: [u8; 4]) -> Vec<u8> {
    let length = u16::try_from(text.len()).expect("short");
    let mut bytes = vec![0x81];
    match u8::try_from(length) {
        Ok(short) if short < 126 => bytes.push(0x80 | short),
        _ => {
            bytes.push(0x80 | 126);
            bytes.extend(length.to_be_bytes());
        }
    }
    bytes.extend(mask);
    bytes.extend(text.bytes().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask));
    bytes
}
