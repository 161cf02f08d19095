//! Noise on the wire, late and missing replies, echoes, and more servos than the wire carries.

use super::*;

#[test]
fn a_crowded_bus_is_refused() {
    let mut robot = config::motor::parse(ROBOT, "motor.toml".as_ref()).unwrap();
    let settings = config::parse(SETTINGS, "leo.toml".as_ref()).unwrap();
    for id in 3..40 {
        let mut joint = robot.joints[0].clone();
        joint.id = id;
        robot.joints.push(joint);
    }
    let refused = Motor::new(&robot, &settings).err();
    assert_eq!(refused, Some(MotorError::Crowded { bus: "left".to_owned(), servos: 39 }));
}

#[test]
fn on_a_noisy_wire_every_joint_recovers_and_no_command_jumps() {
    let mut rig = following();
    let mut interrupted = 0;
    for seed in 0..6 {
        rig.noise = Some(ChaCha8Rng::seed_from_u64(seed));
        let mut before = [None; 3];
        for cycle in 0..400 {
            let goal_rad = if cycle % 100 < 50 { 0.9 } else { -0.9 };
            rig.commanded(1, goal_rad, rig.now);
            for (joint, before) in before.iter_mut().enumerate() {
                let command = rig.state(joint).command_position_rad();
                if let (Some(before), Some(command)) = (*before, command) {
                    let step: f64 = command - before;
                    assert!(step.abs() <= 2.0 * PERIOD.as_secs_f64() + 1e-9, "joint {joint} jumps by {step}");
                    assert!(command.abs() <= 1.0);
                }
                interrupted += u32::from(before.is_some() && command.is_none());
                *before = command;
            }
        }
        let troubles: Vec<_> = (0..3).filter_map(|joint| rig.motor.trouble(joint)).collect();
        assert_eq!(troubles, [], "noise is no fault of a servo");
        rig.noise = None;
        rig.commanded(600, 0.0, rig.now);
        assert_eq!(rig.modes(), [JointMode::Following; 3], "seed {seed}");
        assert!((rig.position(0)).abs() < 0.003);
    }
    assert!(interrupted > 0, "the noise did not matter");
}

#[test]
fn a_reply_repeated_one_cycle_later_is_dropped() {
    let mut rig = following();
    rig.commanded(1, 0.0, rig.now);
    // Bus 1 was asked last: these are its answers.
    let mut late = rig.replies.clone();
    let seen_at = rig.state(2).sampled_at_ns;
    assert_eq!(seen_at, rig.now.as_nanos());
    rig.now += PERIOD;
    rig.motor.goals(rig.now, &[]);
    rig.motor.step(rig.now);
    rig.motor.request(1, rig.now, &mut rig.request);
    late.stamp(rig.now);
    rig.motor.replies(1, rig.now, &late);
    assert_eq!(rig.state(2).sampled_at_ns, seen_at);
    assert_eq!(rig.motor.counts().stale, 1);
}

#[test]
fn after_a_missing_reply_the_next_request_expects_another_length() {
    let mut rig = following();
    rig.commanded(100, 0.0, rig.now);
    let lengths = |rig: &mut Rig, cycles: usize| {
        let mut asked = Vec::new();
        for _ in 0..cycles {
            rig.commanded(1, 0.0, rig.now);
            let part = rig.request.parts().next().unwrap().0;
            asked.push(part.data - usize::from(servo::Reading::ITEM.length));
        }
        asked
    };
    assert_eq!(lengths(&mut rig, 5), [0; 5]);
    rig.mute.insert((1, 1));
    assert_eq!(lengths(&mut rig, 1), [0], "it is this answer that is missing");
    rig.mute.clear();
    let rotating = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0];
    assert_eq!(lengths(&mut rig, 24), [rotating, rotating].concat());
    assert_eq!(lengths(&mut rig, 3), [0; 3]);
}

#[test]
fn a_bus_with_an_echoing_adapter_is_clean() {
    let mut rig = following();
    for bus in 0..2 {
        rig.inject(bus, "echo");
    }
    rig.commanded(100, 0.0, rig.now);
    let part = rig.request.parts().next().unwrap().0;
    assert_eq!(part.data, usize::from(servo::Reading::ITEM.length));
    assert_eq!(rig.motor.bus_health(0).late_bytes, 0);
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
}
