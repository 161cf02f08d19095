//! Truncated and damaged traces.

use super::*;

#[test]
fn a_truncated_trace_keeps_its_first_half() {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 20] };
    let frames: Vec<Frame> = (1..500).map(frame).collect();
    for bytes in both(&frames) {
        let (back, error, reader) = read(&bytes[..bytes.len() / 2]);
        assert!(error.is_none() && reader.is_cut());
        assert!((100..400).contains(&back.len()), "{}", back.len());
    }
}

#[test]
fn a_damaged_chunk_is_reported_and_everything_before_it_is_read() {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 20] };
    let frames: Vec<Frame> = (1..500).map(frame).collect();
    let [_, mut bytes] = both(&frames);
    let (mut chunks, mut at) = (Vec::new(), mcap::MAGIC.len());
    while bytes[at] != mcap::records::op::FOOTER {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        let end = at + 9 + usize::try_from(length).unwrap();
        chunks.extend((bytes[at] == mcap::records::op::CHUNK).then_some((at + end) / 2));
        at = end;
    }
    // The middle of the compressed records; an index beside them has no checksum.
    bytes[chunks[chunks.len() / 2]] ^= 0x55;
    let (back, error, reader) = read(&bytes);
    let error = error.unwrap();
    let read_before = u64::try_from(back.len()).unwrap();
    assert!(matches!(&error, TraceError::Damaged { after, .. } if *after == read_before), "{error:?}");
    assert!((20..400).contains(&back.len()) && !reader.is_cut(), "{}", back.len());
    assert_same(&back, &frames[..back.len()]);
}

/// The offsets and opcodes of the records of an MCAP file, up to its footer.
fn records_of(bytes: &[u8]) -> Vec<(usize, u8)> {
    let (mut found, mut at) = (Vec::new(), mcap::MAGIC.len());
    while bytes[at] != mcap::records::op::FOOTER {
        found.push((at, bytes[at]));
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    found
}

/// Frames of 4 chunks at least.
fn chunked(options: WriteOptions) -> (Vec<Frame>, Vec<u8>) {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 5] };
    let frames: Vec<Frame> = (1..100).map(frame).collect();
    let bytes = mcap(&frames, options.chunk_size(Some(16 << 10)));
    assert!(records_of(&bytes).iter().filter(|(_, op)| *op == mcap::records::op::CHUNK).count() > 3);
    (frames, bytes)
}

/// Reads a file that a killed writer left, which must be cut short without an error.
fn read_cut(bytes: &[u8], frames: &[Frame]) -> usize {
    let (back, error, reader) = read(bytes);
    assert!(error.is_none(), "{error:?}");
    assert_same(&back, &frames[..back.len()]);
    let truncation = reader.truncation().expect("it is cut");
    assert_eq!(truncation.frames, u64::try_from(back.len()).unwrap());
    assert!(truncation.bytes <= u64::try_from(bytes.len()).unwrap());
    back.len()
}

#[test]
fn an_unclosed_chunk_ends_the_trace_as_a_cut_does() {
    for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
        let (frames, bytes) = chunked(WriteOptions::new().compression(compression));
        let chunks: Vec<usize> = records_of(&bytes)
            .into_iter()
            .filter_map(|(at, op)| (op == mcap::records::op::CHUNK).then_some(at))
            .collect();
        for (whole, at) in chunks.iter().copied().enumerate().take(3) {
            let cut = &bytes[..at + 400];
            let as_cut = read_cut(cut, &frames);
            assert_eq!(as_cut > 0, whole > 0);
            // What a writer that seeks fills in at last: the record's length, two sizes and the check sum.
            let sizes = |bytes: &mut Vec<u8>, places: &[(usize, usize)]| {
                for (place, length) in places {
                    bytes[at + place..at + place + length].fill(0xff);
                }
            };
            let name = u32::from_le_bytes(bytes[at + 37..at + 41].try_into().unwrap());
            let compressed = 41 + usize::try_from(name).unwrap();
            let all = [(1, 8), (25, 8), (33, 4), (compressed, 8)];
            let mut unclosed = cut.to_vec();
            sizes(&mut unclosed, &all);
            assert_eq!(read_cut(&unclosed, &frames), as_cut);
            // The record's length alone, also one that a file could have.
            let mut unclosed = cut.to_vec();
            for length in [u64::MAX, u64::MAX - 1, 1 << 63, 1 << 40, 65 << 20, 60 << 20] {
                unclosed[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
                assert_eq!(read_cut(&unclosed, &frames), as_cut, "{length}");
            }
            // The sizes in it, with a length that was filled in.
            for places in [&all[1..], &all[1..2], &all[3..]] {
                let mut unclosed = cut.to_vec();
                unclosed[at + 1..at + 9].copy_from_slice(&391_u64.to_le_bytes());
                sizes(&mut unclosed, places);
                assert_eq!(read_cut(&unclosed, &frames), as_cut, "{places:?}");
            }
        }
    }
}

#[test]
fn a_length_beyond_the_file_is_a_cut_for_any_record() {
    let (frames, bytes) = chunked(WriteOptions::new());
    let mut seen = BTreeSet::new();
    for (at, op) in records_of(&bytes) {
        let as_cut = read_cut(&bytes[..at + 5], &frames);
        for length in [u64::MAX, 1 << 40] {
            for opcode in [op, mcap::records::op::MESSAGE, mcap::records::op::ATTACHMENT, 0x90] {
                let mut unclosed = bytes[..at + 30].to_vec();
                unclosed[at] = opcode;
                unclosed[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
                assert_eq!(read_cut(&unclosed, &frames), as_cut);
            }
        }
        seen.insert(op);
    }
    assert!(seen.len() >= 7, "{seen:?}");
    // The file after a record that is too long for any reader, but not for the file, is not cut.
    let (at, _) = records_of(&bytes).into_iter().nth(4).unwrap();
    let mut long = bytes[..at].to_vec();
    long.push(0x90);
    long.extend((65_u64 << 20).to_le_bytes());
    long.resize(long.len() + (65 << 20), 0);
    let (back, error, reader) = read(&long);
    assert!(matches!(error, Some(TraceError::Damaged { .. })) && !reader.is_cut(), "{error:?}");
    assert_same(&back, &frames[..back.len()]);
}

#[test]
fn a_wrong_length_in_a_complete_file_is_damage() {
    let (frames, bytes) = chunked(WriteOptions::new());
    for (at, op) in records_of(&bytes) {
        let as_cut = read_cut(&bytes[..at + 5], &frames);
        // One bit of the length: within the bound of a record, or beyond it.
        for bit in [25, 30, 40, 63] {
            let mut flipped = bytes.clone();
            flipped[at + 1 + bit / 8] ^= 1 << (bit % 8);
            let (back, error, reader) = read(&flipped);
            let said = error.expect("it is damaged").to_string();
            assert!(said.contains(&format!("the record at byte {at} ")) && !reader.is_cut(), "{op}: {said}");
            assert_eq!(back.len(), as_cut);
            // Without its end, the file looks like one of a killed writer, and the bytes not read are counted.
            flipped.pop();
            assert_eq!(read_cut(&flipped, &frames), as_cut);
            let truncation = read(&flipped).2.truncation().unwrap();
            assert_eq!(truncation.incomplete_at, u64::try_from(at).unwrap());
            assert_eq!(truncation.bytes, u64::try_from(flipped.len()).unwrap());
        }
    }
}

#[test]
fn a_wrong_chunk_size_is_a_cut_only_in_the_last_record() {
    for compression in [None, Some(mcap::Compression::Zstd)] {
        let (frames, bytes) = chunked(WriteOptions::new().compression(compression));
        let records = records_of(&bytes);
        let chunk = records.iter().position(|(_, op)| *op == mcap::records::op::CHUNK).unwrap();
        let ((at, _), (next, _)) = (records[chunk], records[chunk + 1]);
        let name = u32::from_le_bytes(bytes[at + 37..at + 41].try_into().unwrap());
        let compressed = at + 41 + usize::try_from(name).unwrap();
        let mut unclosed = bytes[..next].to_vec();
        unclosed[compressed..compressed + 8].fill(0xff);
        assert_eq!(read_cut(&unclosed, &frames), 0);
        let truncation = read(&unclosed).2.truncation().unwrap();
        assert_eq!(truncation.incomplete_at, u64::try_from(at).unwrap());
        for more in [next + 1, next + 20, bytes.len() - 1] {
            for size in [u64::MAX, 1 << 63, 1 << 40] {
                let mut damaged = bytes[..more].to_vec();
                damaged[compressed..compressed + 8].copy_from_slice(&size.to_le_bytes());
                let (back, error, reader) = read(&damaged);
                assert!(matches!(error, Some(TraceError::Damaged { .. })) && !reader.is_cut(), "{error:?}");
                assert!(back.is_empty());
            }
        }
    }
}

#[test]
fn a_cut_line_is_counted() {
    let text = "{\"leo_trace\": 1}\n{\"at_ns\": 1, \"observations\": []}\n{\"at_ns\": 2, ";
    let (frames, error, reader) = read(text.as_bytes());
    assert!(frames.len() == 1 && error.is_none());
    let truncation = reader.truncation().unwrap();
    assert_eq!((truncation.bytes, truncation.incomplete_at, truncation.frames), (63, 50, 1));
    assert_eq!(&text[50..], "{\"at_ns\": 2, ");
}

#[test]
fn a_trace_cut_before_its_first_chunk_says_so() {
    let (frames, bytes) = chunked(WriteOptions::new());
    let chunk = records_of(&bytes).into_iter().find(|(_, op)| *op == mcap::records::op::CHUNK).unwrap().0;
    for length in (1..=9).chain([20, 60, chunk, chunk + 9, chunk + 300]) {
        assert_eq!(read_cut(&bytes[..length], &frames), 0, "{length}");
    }
    // Other bytes than those of the magic are no trace.
    assert!(Reader::new(&b"\x89MCAQ"[..], "t").is_err());
    let (_, _, reader) = read(&bytes[..chunk + 300]);
    let truncation = reader.truncation().unwrap();
    let length = u64::try_from(chunk).unwrap();
    assert_eq!((truncation.bytes, truncation.incomplete_at), (length + 300, length));
    let one = crate::Truncation { bytes: 100, incomplete_at: 99, frames: 1 };
    let two = crate::Truncation { bytes: 100, incomplete_at: 100, frames: 2 };
    let none = crate::Truncation { bytes: 100, incomplete_at: 58, frames: 0 };
    insta::assert_snapshot!([none, one, two].map(|end| end.to_string()).join("\n"));

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    std::fs::write(&file, &bytes[..chunk + 300]).unwrap();
    let refused = crate::Playback::open(&file, None, false).unwrap_err();
    assert!(matches!(&refused, crate::PlaybackError::CutShort { truncation, .. } if truncation.frames == 0));
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    assert!(crate::Playback::open(&file, None, false).unwrap().is_cut());
}
