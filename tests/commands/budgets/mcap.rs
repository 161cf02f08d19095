//! Hand-made MCAP files: small files that expand to many bytes.

use std::collections::BTreeMap;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// A file of records.
pub(super) struct Mcap(Vec<u8>);

impl Mcap {
    pub(super) fn new(profile: &str) -> Self {
        let mut file = Self(MAGIC.to_vec());
        file.record(0x01, &[text(profile), text("a test")].concat());
        file
    }

    /// The header of a recording of Leo, in lockstep time.
    pub(super) fn recording() -> Self {
        let about = BTreeMap::from([
            ("time", "lockstep"),
            ("partners", "1"),
            ("program", "a test"),
            ("base_in_world", "0 0 0 0 0 0 1"),
        ]);
        let entries: Vec<u8> =
            about.iter().flat_map(|(key, value)| [text(key), text(value)].concat()).collect();
        let length = u32::try_from(entries.len()).expect("is short").to_le_bytes();
        let mut file = Self::new("ros2");
        file.record(0x0C, &[text("leo"), length.to_vec(), entries].concat());
        file
    }

    pub(super) fn record(&mut self, opcode: u8, body: &[u8]) -> &mut Self {
        self.0.extend(record(opcode, body));
        self
    }

    /// A compressed chunk of records, with a valid check sum or none.
    pub(super) fn chunk(&mut self, records: &[u8], is_checked: bool) -> &mut Self {
        let small = zstd::encode_all(records, 3).expect("compresses");
        let crc = if is_checked { crc32fast::hash(records) } else { 0 };
        let size = |bytes: &[u8]| u64::try_from(bytes.len()).expect("a length").to_le_bytes();
        let head = [&[0; 16][..], &size(records), &crc.to_le_bytes(), &text("zstd"), &size(&small)].concat();
        self.record(0x06, &[head, small].concat())
    }

    /// The complete file.
    pub(super) fn end(&mut self) -> Vec<u8> {
        self.record(0x0F, &[0; 4]);
        self.record(0x02, &[0; 20]);
        self.0.extend(MAGIC);
        std::mem::take(&mut self.0)
    }
}

pub(super) fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let length = u64::try_from(body.len()).expect("a length").to_le_bytes();
    [&[opcode][..], &length, body].concat()
}

pub(super) fn text(text: &str) -> Vec<u8> {
    [&u32::try_from(text.len()).expect("is short").to_le_bytes(), text.as_bytes()].concat()
}

/// A schema of `bytes` bytes.
pub(super) fn schema(id: u16, encoding: &str, bytes: usize) -> Vec<u8> {
    let length = u32::try_from(bytes).expect("is short").to_le_bytes();
    let body = [&id.to_le_bytes()[..], &text("a"), &text(encoding), &length, &vec![b'a'; bytes]];
    record(0x03, &body.concat())
}

/// An attachment of `bytes` bytes.
pub(super) fn attachment(name: &str, bytes: usize) -> Vec<u8> {
    let length = u64::try_from(bytes).expect("a length").to_le_bytes();
    let body = [&[0; 16][..], &text(name), &text("text/plain"), &length, &vec![b'a'; bytes], &[0; 4]];
    record(0x09, &body.concat())
}

/// A channel of a source's observations, in JSON.
pub(super) fn channel(source: u16) -> Vec<u8> {
    let topic = text(&format!("observations/{source}"));
    let ids = [source.to_le_bytes(), [0; 2]].concat();
    record(0x04, &[ids, topic, text("json"), vec![0; 4]].concat())
}

pub(super) fn message(channel: u16, json: &str) -> Vec<u8> {
    record(0x05, &[&channel.to_le_bytes()[..], &[0; 20], json.as_bytes()].concat())
}

/// Clears the check sums of all chunks; returns the number of chunks.
pub(super) fn without_check_sums(file: &mut [u8]) -> usize {
    const CRC: usize = 9 + 24;
    let (mut at, mut chunks) = (MAGIC.len(), 0);
    while let Some([opcode, length @ ..]) = file.get(at..).and_then(<[u8]>::first_chunk::<9>).copied() {
        if opcode == 0x06 {
            file.get_mut(at + CRC..at + CRC + 4).expect("is whole").fill(0);
            chunks += 1;
        }
        if opcode == 0x02 {
            break;
        }
        at += 9 + usize::try_from(u64::from_le_bytes(length)).expect("a length");
    }
    chunks
}
