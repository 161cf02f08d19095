//! The report of `leo bench`.

use std::fmt;
use std::time::Duration;

use message::Histogram;
use reports::metrics::Quantiles;
use serde::Serialize;

use super::Case;
use super::leo::Measured;

/// All measurements, and the machine.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub(super) machine: Machine,
    pub(super) rows: Vec<Row>,
    /// Over all rates and sizes, because one case has too few wake-ups in its tail.
    pub(super) wakeup: Wakeup,
}

/// Wake-up latency of the sensor process and of a bare thread of the same priority at the same time.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Wakeup {
    sensor_us: Quantiles,
    bare_us: Quantiles,
    /// Sensor / bare.
    ratio_p50: f64,
    ratio_p99: f64,
    ratio_p999: f64,
}

impl Wakeup {
    pub(super) fn of(sensor: &Histogram, bare: &Histogram) -> Self {
        let (sensor_us, bare_us) = (Quantiles::of(sensor), Quantiles::of(bare));
        Self {
            sensor_us,
            bare_us,
            ratio_p50: sensor_us.p50 / bare_us.p50,
            ratio_p99: sensor_us.p99 / bare_us.p99,
            ratio_p999: sensor_us.p999 / bare_us.p999,
        }
    }
}

/// The measured machine.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Machine {
    processor: String,
    cores: usize,
    kernel: String,
    scheduling: String,
    commit: String,
}

/// One rate and size.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    rate_hz: u32,
    objects: u32,
    /// From percept buffer published to belief buffers read.
    percept_to_belief_us: Quantiles,
    /// Duration of the belief process's step, publishing included.
    belief_step_us: Quantiles,
    /// The same over frames of this case in a loop, with copying instead of publishing.
    belief_loop_us: Quantiles,
    /// Belief step / loop at p50 and p99.
    loop_ratio_p50: f64,
    loop_ratio_p99: f64,
    /// Round trip of as many bytes with the bare middleware.
    bare_round_trip_us: Quantiles,
    /// (percept to belief - step) / round trip at p50 and p99: the latency that Leo adds to the middleware.
    ratio_p50: f64,
    ratio_p99: f64,
    wakeup: Wakeup,
    /// Number of lost belief frames.
    lost: u64,
    /// Upper bound in nanoseconds and count of each bucket of the percept-to-belief latency.
    histogram: Vec<(u64, u32)>,
}

impl Machine {
    pub(super) fn here(realtime: bool, awake: bool, commit: &str) -> Self {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = cpuinfo
            .lines()
            .find_map(|line| line.strip_prefix("model name")?.split_once(':'))
            .map_or_else(|| "unknown".to_owned(), |(_, name)| name.trim().to_owned());
        let system = rustix::system::uname();
        Self {
            processor,
            cores: std::thread::available_parallelism().map_or(0, usize::from),
            kernel: format!("{} {}", system.release().to_string_lossy(), system.version().to_string_lossy()),
            scheduling: format!(
                "{}, cores {}",
                if realtime { "SCHED_FIFO, memory locked" } else { "ordinary: real-time rights are missing" },
                if awake { "kept awake" } else { "sleep" }
            ),
            commit: commit.to_owned(),
        }
    }
}

pub(super) fn row(case: Case, leo: &Measured, in_a_loop: &Histogram, round_trip: &Histogram) -> Row {
    let latency = Quantiles::of(&leo.latency);
    let step = Quantiles::of(&leo.step);
    let in_a_loop = Quantiles::of(in_a_loop);
    let bare = Quantiles::of(round_trip);
    Row {
        rate_hz: case.rate_hz,
        objects: case.objects,
        percept_to_belief_us: latency,
        belief_step_us: step,
        belief_loop_us: in_a_loop,
        loop_ratio_p50: step.p50 / in_a_loop.p50,
        loop_ratio_p99: step.p99 / in_a_loop.p99,
        bare_round_trip_us: bare,
        ratio_p50: (latency.p50 - step.p50) / bare.p50,
        ratio_p99: (latency.p99 - step.p99) / bare.p99,
        wakeup: Wakeup::of(&leo.sensor_wakeup, &leo.bare_wakeup),
        lost: leo.lost,
        histogram: leo.latency.buckets().collect(),
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let machine = &self.machine;
        writeln!(out, "{} ({} cores), kernel {}", machine.processor, machine.cores, machine.kernel)?;
        writeln!(out, "scheduling: {}; commit {}\n", machine.scheduling, machine.commit)?;
        writeln!(out, "us             objects      p50      p99    p99.9      max   count")?;
        for row in &self.rows {
            writeln!(out, "{} Hz, {} objects", row.rate_hz, row.objects)?;
            line(out, "percept to belief", &row.percept_to_belief_us)?;
            line(out, "  the belief step", &row.belief_step_us)?;
            line(out, "    in a loop", &row.belief_loop_us)?;
            line(out, "  bare round trip", &row.bare_round_trip_us)?;
            line(out, "sensor wake-up", &row.wakeup.sensor_us)?;
            line(out, "  bare wake-up", &row.wakeup.bare_us)?;
            writeln!(out, "  step / loop: p50 {:.2}, p99 {:.2}", row.loop_ratio_p50, row.loop_ratio_p99)?;
            writeln!(
                out,
                "  (latency - step) / round trip: p50 {:.2}, p99 {:.2}; lost {}",
                row.ratio_p50, row.ratio_p99, row.lost
            )?;
            draw(out, &row.histogram)?;
        }
        let Wakeup { sensor_us, bare_us, ratio_p50, ratio_p99, ratio_p999 } = &self.wakeup;
        writeln!(out, "all rates and sizes")?;
        line(out, "sensor wake-up", sensor_us)?;
        line(out, "  bare wake-up", bare_us)?;
        writeln!(out, "  sensor / bare: p50 {ratio_p50:.2}, p99 {ratio_p99:.2}, p99.9 {ratio_p999:.2}")
    }
}

fn line(out: &mut fmt::Formatter<'_>, name: &str, quantiles: &Quantiles) -> fmt::Result {
    let Quantiles { count, p50, p99, p999, max } = quantiles;
    writeln!(out, "  {name:<20} {p50:>8.1} {p99:>8.1} {p999:>8.1} {max:>8.1} {count:>7}")
}

/// Prints the histogram of percept to belief as bars, one line per octave.
fn draw(out: &mut fmt::Formatter<'_>, buckets: &[(u64, u32)]) -> fmt::Result {
    let mut octaves: Vec<(u32, u64)> = Vec::new();
    for &(bound_ns, count) in buckets {
        let octave = bound_ns.max(1).ilog2();
        match octaves.last_mut() {
            Some((last, sum)) if *last == octave => *sum += u64::from(count),
            _ => octaves.push((octave, u64::from(count))),
        }
    }
    let highest = octaves.iter().map(|(_, count)| *count).max().unwrap_or(1).max(1);
    for (octave, count) in octaves {
        let below_us = Duration::from_nanos(1 << (octave + 1)).as_secs_f64() * 1e6;
        let width = usize::try_from(count * 50 / highest).unwrap_or(50);
        writeln!(out, "  < {below_us:>8.1} us {count:>7} {}", "#".repeat(width.max(1)))?;
    }
    Ok(())
}
