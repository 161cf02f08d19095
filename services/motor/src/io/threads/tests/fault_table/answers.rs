//! Answers that arrive corrupt, late or not at all.

use super::*;
use crate::JointFault;

/// Number of faults counted on the bus of a joint.
fn noticed(rig: &Rig, joint: usize) -> u64 {
    let counts = rig.motor.bus_counts(rig.robot.motor.joints[joint].bus);
    counts.corrupt + counts.missed + counts.stale + counts.late_bytes
}

/// How often a fault occurred on the bus of each joint, and how many faults were counted.
fn happened(rig: &Rig, joints: &[usize], kind: FaultKind) -> Vec<(u64, u64)> {
    joints.iter().map(|&joint| (rig.injected(joint, kind), noticed(rig, joint))).collect()
}

#[test]
fn a_corrupt_reply_is_detected_at_once_and_costs_no_other_reading() {
    broken_answers(&mut following(), true);
}

#[test]
fn a_corrupt_reply_of_older_firmware_costs_no_other_reading() {
    broken_answers(&mut following_on_old_firmware(), false);
}

/// Corrupts an answer of each joint in every way, with fast sync reads or sync reads.
fn broken_answers(rig: &mut Rig, is_chain: bool) {
    for kind in [
        FaultKind::Flip,
        FaultKind::Truncate,
        FaultKind::Length,
        FaultKind::Noise,
        FaultKind::Duplicate,
        FaultKind::Swap,
    ] {
        let seen = std::cell::Cell::new(0);
        in_turn(rig, |rig, struck| {
            let before: Vec<u64> = struck.iter().map(|&joint| rig.state(joint).sampled_at_ns).collect();
            let counted = happened(rig, struck, kind);
            rig.inject(kind.name(), struck, "");
            rig.cycle();
            others_go_on(rig, struck)?;
            for (&joint, sampled_at_ns) in struck.iter().zip(before) {
                let mode = rig.mode(joint);
                expect(mode == JointMode::Following, || format!("{mode:?} for one answer"))?;
                let ages = rig.state(joint).sampled_at_ns == sampled_at_ns;
                expect(rig.is_read(joint) || ages, || "neither read nor aged".to_owned())?;
            }
            for ((times, counts), (before, counted)) in happened(rig, struck, kind).into_iter().zip(counted) {
                // Answers that carry their identifiers may arrive in another order.
                let is_well =
                    kind == FaultKind::Swap && !is_chain && struck.iter().all(|&joint| rig.is_read(joint));
                let is_noticed = counts > counted || is_well;
                expect(times == before || is_noticed, || format!("nobody noticed {kind:?}"))?;
                seen.set(seen.get() + times - before);
            }
            rig.inject("", &[], "");
            rig.cycle();
            others_go_on(rig, &[])
        });
        // In a chain only the first servo of each bus sends a length.
        let min = if kind == FaultKind::Length && is_chain { 5 } else { 60 };
        assert!(seen.get() >= min, "{kind:?} happened {} times", seen.get());
    }
}

#[test]
fn a_servo_is_quarantined_after_three_silent_cycles_and_comes_back() {
    let mut rig = following();
    in_turn(&mut rig, |rig, struck| {
        let missed: Vec<u64> =
            struck.iter().map(|&joint| rig.motor.bus_counts(bus(rig, joint)).missed).collect();
        rig.inject("drop", struck, "");
        for _ in 0..2 {
            rig.cycle();
            others_go_on(rig, struck)?;
            are(rig, struck, JointMode::Following, JointCause::None)?;
        }
        rig.cycle();
        others_go_on(rig, struck)?;
        are(rig, struck, JointMode::Quarantined, JointCause::Silent)?;
        for (&joint, missed) in struck.iter().zip(missed) {
            let (bus, counts) = (bus(rig, joint), rig.motor.bus_counts(bus(rig, joint)));
            expect(rig.motor.quarantined(bus) == 1, || "not counted as quarantined".to_owned())?;
            expect(counts.missed >= missed + 3, || "not counted as missed".to_owned())?;
        }
        // It is pinged after 0.1 s and after 0.2 s more, and not in between.
        let asked =
            |rig: &Rig| -> u64 { struck.iter().map(|&joint| rig.injected(joint, FaultKind::Drop)).sum() };
        let (before, once) = (asked(rig), u64::try_from(struck.len()).unwrap());
        for (time, times) in [(90, 0), (60, 1), (130, 1), (80, 2)] {
            for _ in 0..cycles_in(Duration::from_millis(time)) {
                rig.cycle();
                others_go_on(rig, struck)?;
            }
            let pings = asked(rig) - before;
            expect(pings == times * once, || format!("{pings} pings to {once} servos, not {times} each"))?;
        }
        are(rig, struck, JointMode::Quarantined, JointCause::Silent)?;
        rig.inject("", &[], "");
        within(rig, cycles_in(Duration::from_millis(800)), |rig| {
            are(rig, struck, JointMode::Following, JointCause::None)
        })
    });
}

#[test]
fn a_servo_with_a_stopped_clock_is_quarantined_after_25_readings() {
    let mut rig = following();
    in_turn(&mut rig, |rig, struck| {
        let verdict = stopped_clocks(rig, struck);
        rig.inject("", &[], "");
        rig.motor.recover();
        verdict
    });
}

fn stopped_clocks(rig: &mut Rig, struck: &[usize]) -> Verdict {
    rig.inject("stopped-clock", struck, "");
    // A reading requested before its clock stopped may still be fresh.
    for _ in 0..24 {
        rig.cycle();
        others_go_on(rig, struck)?;
        are(rig, struck, JointMode::Following, JointCause::None)?;
    }
    within(rig, 2, |rig| are(rig, struck, JointMode::Quarantined, JointCause::Stale))?;
    for &joint in struck {
        let trouble = rig.motor.trouble(joint);
        expect(trouble == Some(JointFault::Unbelieved), || format!("{trouble:?}"))?;
        expect(rig.motor.quarantined(bus(rig, joint)) == 1, || "not counted as quarantined".to_owned())?;
    }
    // It keeps answering, but its readings are still rejected.
    for _ in 0..cycles_in(Duration::from_secs(2)) {
        rig.cycle();
        others_go_on(rig, struck)?;
        are(rig, struck, JointMode::Quarantined, JointCause::Stale)?;
    }
    Ok(())
}

#[test]
fn a_reply_to_an_earlier_request_is_counted_and_never_used() {
    let mut rig = following();
    // Three cycles later an answer of the same length is expected.
    for late in ["by=3ms", "by=10ms", "by=12ms"] {
        in_turn(&mut rig, |rig, struck| {
            let counted = happened(rig, struck, FaultKind::Late);
            rig.inject("late", struck, late);
            for _ in 0..2 {
                rig.cycle();
                others_go_on(rig, struck)?;
            }
            rig.inject("", &[], "");
            for _ in 0..6 {
                // Accepted readings are compared with the servo's position.
                rig.cycle();
                others_go_on(rig, struck)?;
                struck.iter().for_each(|&joint| _ = rig.is_read(joint));
            }
            for ((times, counts), (before, counted)) in
                happened(rig, struck, FaultKind::Late).into_iter().zip(counted)
            {
                expect(times > before && counts > counted, || "nobody noticed".to_owned())?;
            }
            Ok(())
        });
    }
}

fn bus(rig: &Rig, joint: usize) -> usize {
    rig.robot.motor.joints[joint].bus
}
