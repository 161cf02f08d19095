//! A histogram as text bars, one per octave.

use std::time::Duration;

use message::Histogram;
use quantity::number::{float, floor_usize};

/// Length of the longest bar.
const BAR: f64 = 9.0;

/// One line per octave between the smallest and the largest value; empty if nothing was counted.
pub(super) fn lines(histogram: &Histogram) -> Vec<String> {
    let mut octaves: Vec<(u32, u64)> = Vec::new();
    for (max, count) in histogram.buckets() {
        let octave = max.max(1).ilog2();
        if let Some((last, _)) = octaves.last().copied() {
            // Show empty octaves too, so that gaps in the distribution are visible.
            octaves.extend((last + 1..octave).map(|empty| (empty, 0)));
        }
        match octaves.last_mut() {
            Some((last, sum)) if *last == octave => *sum += u64::from(count),
            Some(_) | None => octaves.push((octave, u64::from(count))),
        }
    }
    let max = octaves.iter().map(|(_, count)| *count).max().unwrap_or(0);
    let line = |(octave, count): (u32, u64)| {
        let bound = Duration::from_nanos(1_u64.checked_shl(octave + 1).unwrap_or(u64::MAX));
        let full = floor_usize((BAR * float(count) / float(max.max(1))).ceil());
        format!("< {:>8} {:<9} {count}", duration_text(bound), "█".repeat(full))
    };
    octaves.into_iter().map(line).collect()
}

fn duration_text(time: Duration) -> String {
    let micros = time.as_secs_f64() * 1e6;
    if micros < 10.0 {
        format!("{micros:.1} µs")
    } else if micros < 10_000.0 {
        format!("{micros:.0} µs")
    } else {
        format!("{:.0} ms", micros / 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_octave_has_a_bar_and_a_gap_is_seen() {
        let mut histogram = Histogram::default();
        for nanos in [20_000, 21_000, 22_000, 23_000, 140_000] {
            histogram.record(nanos);
        }
        let told = lines(&histogram);
        let counts: Vec<&str> = told.iter().filter_map(|line| line.split(' ').next_back()).collect();
        assert_eq!(counts, ["4", "0", "0", "1"], "{told:?}");
        assert!(told[0].starts_with("<    33 µs █████████ 4"), "{told:?}");
        assert!(told[3].starts_with("<   262 µs ███ "), "{told:?}");
        assert!(lines(&Histogram::default()).is_empty());
    }
}
