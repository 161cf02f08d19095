//! Tracking: identities of things that move.

use super::*;

/// How a thing moves: its position at a number of seconds, at a speed in m/s.
type Path = fn(f32, f32) -> [f32; 3];

fn straight(seconds: f32, speed_m_s: f32) -> [f32; 3] {
    [0.6, speed_m_s * seconds, 0.03]
}

/// On a circle of 40 cm.
fn circle(seconds: f32, speed_m_s: f32) -> [f32; 3] {
    let angle = speed_m_s * seconds / 0.4;
    [0.6 + 0.4 * angle.cos(), 0.4 * angle.sin(), 0.03]
}

/// Half a second of motion, half a second of rest, in turn.
fn stopping(seconds: f32, speed_m_s: f32) -> [f32; 3] {
    let (whole, part) = (seconds.floor(), seconds.fract());
    straight(0.5 * whole + part.min(0.5), speed_m_s)
}

/// The instant of a frame.
fn instant_of(frame: u16, rate_hz: u16) -> Instant {
    Instant::from_nanos(1_000_000_000 + u64::from(frame) * 1_000_000_000 / u64::from(rate_hz))
}

/// The identities that a thing has had, announced or not, after two seconds.
fn identities(percepts: &Percepts, path: Path, metres_a_frame: f32, rate_hz: u16) -> u64 {
    let mut robot = Robot::new(percepts);
    let rate = f32::from(rate_hz);
    for frame in 0..2 * rate_hz {
        let now = instant_of(frame, rate_hz);
        let seconds = f32::from(frame) / rate;
        robot.see(now, &[block(now, path(seconds, metres_a_frame * rate), RED)], true);
    }
    let counts = robot.system.counts();
    counts.created - counts.merged
}

fn remembered() -> Percepts {
    let mut percepts = Percepts::builtin();
    percepts.belief.tracking = None;
    percepts
}

#[test]
fn identities_of_one_moving_thing_by_speed_rate_and_path() {
    let tracked = Percepts::builtin();
    let mut table = String::from("identities of one thing in 2 s: predicted (remembered)\n");
    for (name, path) in [("straight", straight as Path), ("circle", circle), ("stopping", stopping)] {
        for rate_hz in [10, 30, 200] {
            table += &format!("{name:>8} {rate_hz:>3} Hz:");
            for centimetres in [5, 8, 10, 14, 20, 30, 50, 100, 150_u16] {
                let metres = f32::from(centimetres) / 100.0;
                let [with, without] =
                    [&tracked, &remembered()].map(|percepts| identities(percepts, path, metres, rate_hz));
                table += &format!(" {centimetres} cm {with} ({without})");
            }
            table.push('\n');
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_thing_at_2_m_s_and_10_hz_has_one_identity() {
    assert_eq!(identities(&Percepts::builtin(), straight, 0.2, 10), 1);
    assert!(identities(&remembered(), straight, 0.2, 10) > 5);
}

#[test]
fn two_equal_things_that_cross_keep_their_identities() {
    for (rate_hz, speed_m_s) in [(10_u16, 0.5_f32), (10, 1.0), (10, 2.0), (30, 1.0), (200, 2.0)] {
        let mut robot = Robot::new(&Percepts::builtin());
        let frames = rate_hz * 2;
        for frame in 0..frames {
            let now = instant_of(frame, rate_hz);
            let along = speed_m_s * (f32::from(frame) / f32::from(rate_hz) - 1.0);
            // They pass each other at 4 cm.
            robot.see(now, &[block(now, [0.6, along, 0.0], RED), block(now, [0.64, -along, 0.0], RED)], true);
        }
        assert_eq!(robot.ids(), [1, 2], "{rate_hz} Hz, {speed_m_s} m/s");
        let x = [0, 1].map(|index| robot.system.position(index).unwrap()[0]);
        assert!((x[0] - 0.6).abs() < 0.001 && (x[1] - 0.64).abs() < 0.001, "{rate_hz} {speed_m_s} {x:?}");
    }
}

#[test]
fn a_thing_that_crosses_a_crowd_of_equal_ones_keeps_its_identity() {
    for (rate_hz, speed_m_s) in [(10_u16, 0.5_f32), (10, 1.0), (30, 1.0), (200, 2.0)] {
        let mut robot = Robot::new(&Percepts::builtin());
        robot.system = BeliefSystem::new(&Percepts::builtin(), 128).unwrap();
        // 63 blocks of 6 cm at 14 cm from each other; the lane is in the middle between two rows.
        let crowd = (0..63_u8).map(|number| {
            let [row, column] = [number / 9, number % 9].map(f32::from);
            [0.4 + 0.14 * row, 0.14 * (column - 4.0), 0.03]
        });
        let crowd: Vec<_> = crowd.collect();
        let place = |frame: u16| speed_m_s * f32::from(frame) / f32::from(rate_hz) - 0.7;
        for frame in (0..).take_while(|frame| place(*frame) <= 0.7) {
            let (now, along) = (instant_of(frame, rate_hz), place(frame));
            let places = crowd.iter().copied().chain([[0.75, along, 0.03]]);
            let seen: Vec<_> = places.map(|place| block(now, place, RED)).collect();
            robot.see(now, &seen, true);
        }
        assert_eq!(robot.ids(), (1..=64).collect::<Vec<_>>(), "{rate_hz} Hz, {speed_m_s} m/s");
        let last = robot.system.motion(63, robot.system.now()).unwrap().position_m;
        assert!(last[1] > 0.55, "{rate_hz} Hz, {speed_m_s} m/s: {last:?}");
    }
}

#[test]
fn a_belief_is_announced_after_three_sightings_or_a_confident_one() {
    let mut percepts = Percepts::builtin();
    percepts.belief.tracking.as_mut().unwrap().announce_after = 3;
    let mut robot = Robot::new(&percepts);
    let (here, there) = ([0.5, 0.0, 0.0], [0.5, 0.5, 0.0]);
    for frame in 0..4 {
        robot.see(ms(5 * frame), &[block(ms(5 * frame), here, RED)], true);
    }
    assert_eq!(robot.ids(), [1]);
    let both = |now| [block(now, here, RED), block(now, there, BLUE)];
    robot.see(ms(20), &both(ms(20)), true);
    assert_eq!(robot.ids(), [1], "a false detection would look like this");
    robot.see(ms(25), &[block(ms(25), here, RED)], true);
    assert_eq!(robot.system.live_len(), 1, "it is not confirmed");
    for (millis, ids) in [(30, vec![1]), (35, vec![1]), (40, vec![1, 3])] {
        robot.see(ms(millis), &both(ms(millis)), true);
        assert_eq!(robot.ids(), ids, "{millis}");
    }
    let certain = Observation { confidence: 1.0, ..block(ms(45), [0.5, -0.5, 0.0], BLUE) };
    robot.see(ms(45), &[certain], true);
    assert_eq!(robot.ids(), [1, 3, 4]);
}

#[test]
fn a_thing_that_passes_behind_an_occluder_keeps_its_identity() {
    // From 0.0 to 0.8 m the thing is hidden for 2 s.
    let is_hidden = |y: f32| (0.0..0.8).contains(&y);
    for (stops, colour, ids) in [(false, RED, vec![1]), (true, RED, vec![1]), (false, BLUE, vec![1, 2])] {
        let mut robot = Robot::new(&Percepts::builtin());
        for frame in 0..60_u16 {
            let now = ms(1_000 + 100 * u64::from(frame));
            let along = 0.4 * (f32::from(frame) / 10.0 - 2.0);
            // One that stops behind the occluder comes out when it is pushed on, 2 s later.
            let along = if stops && along >= 0.0 { (along - 0.4).max(0.0) } else { along };
            let of = if along > 0.4 { colour } else { RED };
            let seen = [block(now, [0.6, along, 0.03], of)];
            let seen = if is_hidden(along) { &[][..] } else { &seen[..] };
            robot.see_where(now, seen, |place| !is_hidden(place[1]));
        }
        assert_eq!(robot.ids(), ids, "stops: {stops}");
    }
}

#[test]
fn almost_exact_positions_leave_finite_tracks() {
    let mut percepts = Percepts::builtin();
    let tracking = percepts.belief.tracking.as_mut().unwrap();
    (tracking.acceleration_sd_m_s2, tracking.speed_sd_m_s, tracking.position_sd_of_size) = (0.0, 0.0, 0.0);
    let mut robot = Robot::new(&percepts);
    for frame in 0..4 {
        let now = Instant::from_nanos(1_000_000_000 + frame);
        let exact = Observation { position_sd_m: [1e-30; 3], ..block(now, [0.5, 0.0, 0.0], RED) };
        robot.see(now, &[exact], true);
    }
    assert_eq!(robot.ids(), [1]);
    let motion = robot.system.motion(0, robot.system.now()).unwrap();
    assert_eq!(motion.position_m.map(f32::to_bits), [0.5_f32, 0.0, 0.0].map(f32::to_bits), "{motion:?}");
    assert!(motion.position_variance_m2.iter().all(|variance| *variance > 0.0), "{motion:?}");
}

#[test]
fn a_stated_standard_deviation_weighs_an_observation_and_turns_with_the_frame() {
    let mut robot = Robot::new(&Percepts::builtin());
    let seen = |position_sd_m: [f32; 3]| Observation {
        position_sd_m,
        half_extents_m: [message::UNOBSERVED; 3],
        ..block(ms(0), [0.5, 0.0, 0.0], RED)
    };
    robot.see(ms(0), &[seen([0.04, 0.02, 0.0])], true);
    let sds = |robot: &Robot| robot.system.motion(0, ms(0)).unwrap().position_variance_m2.map(f32::sqrt);
    let are = |found: [f32; 3], expected: [f32; 3]| {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6)
    };
    // The third one is not stated.
    assert!(are(sds(&robot), [0.04, 0.02, 0.01]), "{:?}", sds(&robot));
    let quarter =
        Pose::<geometry::Base, geometry::Person>::upright(0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
    robot.system.reanchor(&quarter);
    assert!(are(sds(&robot), [0.02, 0.04, 0.01]), "{:?}", sds(&robot));
    assert!(robot.system.motion(0, ms(0)).unwrap().position_m[1] > 0.49);
}

#[test]
fn the_expected_motion_is_that_of_the_thing() {
    let mut robot = Robot::new(&Percepts::builtin());
    for frame in 0..20_u16 {
        let now = ms(100 * u64::from(frame));
        robot.see(now, &[block(now, straight(f32::from(frame) / 10.0, 0.8), RED)], true);
    }
    let motion = robot.system.motion(0, ms(1950)).unwrap();
    assert!((motion.velocity_m_s[1] - 0.8).abs() < 0.01, "{motion:?}");
    assert!((motion.position_m[1] - 0.8 * 1.95).abs() < 0.01, "{motion:?}");
    let [_, sd, _] = motion.position_variance_m2.map(f32::sqrt);
    assert!((0.005..0.05).contains(&sd), "{sd}");
    // The remembered position is the paper's low-pass and lags.
    assert!(robot.system.position(0).unwrap()[1] < 0.8 * 1.9 - 0.05);
}

#[test]
fn a_belief_is_merged_into_another_only_by_evidence() {
    // One block is covered; an equal one is put down out of its reach, and then pushed to where the first one is.
    for in_view in [true, false] {
        let mut percepts = Percepts::builtin();
        percepts.belief.cull.clear();
        let mut robot = Robot::new(&percepts);
        robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
        let mut len = Vec::new();
        for step in 1..30_u16 {
            let now = ms(2_000 + 100 * u64::from(step));
            let y = (0.4 - 0.05 * f32::from(step)).max(0.0);
            robot.see(now, &[block(now, [0.5, y, 0.0], RED)], in_view);
            len.push(robot.system.len());
        }
        assert_eq!(*len.first().unwrap(), 2);
        assert_eq!(*len.last().unwrap(), if in_view { 1 } else { 2 }, "{len:?}");
    }
}
