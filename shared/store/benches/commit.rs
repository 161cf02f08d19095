//! Time until a change is durable: `cargo bench -p store`.
//!
//! It stores an example repeatedly, in several sizes. For comparison it writes and synchronises a plain file of the
//! same size, in the same run and directory.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::fs::File;
use std::io::Write as _;
use std::time::Duration;

use store::Store;

const SIZES: [usize; 3] = [1_000, 30_000, 300_000];
const COMMITS: usize = 200;

fn main() {
    // On the disk of the working directory: in a memory file system a commit is free.
    let folder = tempfile::tempdir_in(".").expect("a folder");
    let mut store = Store::open(&folder.path().join("learned.store")).expect("a new file");
    println!("time until each of {COMMITS} entries is durable, ms: p50  p99  max");
    println!("{:>9} | {:^26} | {:^26}", "bytes", "save", "write and fsync");
    for bytes in SIZES {
        let entry = "x".repeat(bytes);
        let saved = measure(|| store.put("task 1", &"Task 1", 0, &entry).expect("room"));
        let plain = folder.path().join("plain");
        let written = measure(|| {
            let mut file = File::create(&plain).expect("room");
            file.write_all(entry.as_bytes()).expect("room");
            file.sync_all().expect("a disk");
        });
        let ms = |costs: &[Duration], share: usize| {
            let index = (costs.len() - 1) * share / 100;
            costs.get(index).map_or(0.0, |cost| cost.as_secs_f64() * 1e3)
        };
        let row = |costs: &[Duration]| {
            format!("{:8.2} {:8.2} {:8.2}", ms(costs, 50), ms(costs, 99), ms(costs, 100))
        };
        println!("{bytes:>9} | {} | {}", row(&saved), row(&written));
    }
}

/// The durations of the commits, sorted.
fn measure(mut commit: impl FnMut()) -> Vec<Duration> {
    let mut costs: Vec<Duration> = (0..COMMITS)
        .map(|_| {
            let began = clock::now();
            commit();
            clock::now().since(began)
        })
        .collect();
    costs.sort_unstable();
    costs
}
