use super::*;
use crate::mock::FaultCounts;
use crate::table::{PRESENT_POSITION, STATUS_RETURN_LEVEL, TORQUE_ENABLE};
use crate::{Address, Backup, FastReply, Fault, Id, Instruction, Model, Reset, Status};

fn line() -> Line {
    let servo = |id| Servo::new(Model::Xm430W350, Id::new(id).unwrap(), 0.0, Instant::EPOCH);
    Line::new(vec![servo(1), servo(2), servo(7)])
}

/// The IDs of the replies, and their data lengths.
fn say(line: &mut Line, to: Address, instruction: Instruction<'_>) -> Vec<(u8, Option<Fault>, usize)> {
    let mut bytes = [0; 256];
    let length = instruction.encode(to, &mut bytes).unwrap();
    let mut out = Vec::new();
    line.hear(Instant::EPOCH, &bytes[..length], &mut out);
    let mut parser = Parser::new();
    parser.push(&out);
    let mut answers = Vec::new();
    while let Some(frame) = parser.next_frame() {
        let status = Status::parse(&frame).unwrap();
        answers.push((status.id.get(), status.fault, status.params.len()));
    }
    answers
}

fn one(id: u8) -> Address {
    Id::new(id).unwrap().into()
}

#[test]
fn a_broadcast_ping_is_answered_by_all_servos() {
    let mut line = line();
    assert_eq!(say(&mut line, Address::All, Instruction::Ping), [(1, None, 3), (2, None, 3), (7, None, 3)]);
    assert_eq!(say(&mut line, one(2), Instruction::Ping), [(2, None, 3)]);
    assert_eq!(say(&mut line, one(3), Instruction::Ping), []);
}

#[test]
fn a_sync_read_is_answered_in_the_requested_order() {
    let asked = Instruction::SyncRead { address: PRESENT_POSITION.address, length: 4, ids: &[7, 3, 1] };
    assert_eq!(say(&mut line(), Address::All, asked), [(7, None, 4), (1, None, 4)]);
}

#[test]
fn a_sync_write_is_obeyed_without_replies() {
    let mut line = line();
    let records = &[1, 1, 7, 1];
    let told = Instruction::SyncWrite { address: TORQUE_ENABLE.address, length: 1, records };
    assert_eq!(say(&mut line, Address::All, told), []);
    let torque = line.servos.iter().map(|servo| servo.read(64, 1).unwrap()[0]).collect::<Vec<_>>();
    assert_eq!(torque, [1, 0, 1]);
}

#[test]
fn a_refused_instruction_gets_an_error_reply() {
    let told = Instruction::Write { address: TORQUE_ENABLE.address, data: &[9] };
    assert_eq!(say(&mut line(), one(1), told), [(1, Some(Fault::Range), 0)]);
}

#[test]
fn a_servo_that_answers_only_reads_obeys_writes_silently() {
    let mut line = line();
    let told = Instruction::Write { address: STATUS_RETURN_LEVEL.address, data: &[1] };
    assert_eq!(say(&mut line, one(1), told), []);
    assert_eq!(say(&mut line, one(1), Instruction::Read { address: 68, length: 1 }), [(1, None, 1)]);
}

#[test]
fn the_return_delays_add_up() {
    let mut bytes = [0; 64];
    let length = Instruction::Ping.encode(Address::All, &mut bytes).unwrap();
    let waited = line().hear(Instant::EPOCH, &bytes[..length], &mut Vec::new());
    assert_eq!(waited, Duration::from_micros(1500));
}

fn injected(faults: &[&str], seed: u64) -> Line {
    let mut line = Line { injector: Injector::new("torso", seed), ..line() };
    line.inject(Instant::EPOCH, &faults.iter().map(|text| text.parse().unwrap()).collect::<Vec<_>>());
    line
}

fn at(ms: u64) -> Instant {
    Instant::EPOCH + Duration::from_millis(ms)
}

fn encoded(to: Address, instruction: Instruction<'_>) -> Vec<u8> {
    let mut bytes = vec![0; 256];
    let length = instruction.encode(to, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

fn listen(line: &mut Line, now: Instant, to: Address, instruction: Instruction<'_>) -> Vec<Reply> {
    let mut answers = Replies::default();
    line.listen(now, &encoded(to, instruction), &mut answers);
    answers.list.to_vec()
}

fn ids(answers: &[Reply]) -> Vec<u8> {
    answers.iter().map(|answer| answer.id).collect()
}

const SYNC: Instruction<'static> = Instruction::SyncRead { address: 132, length: 4, ids: &[1, 2, 7] };
const FAST: Instruction<'static> = Instruction::FastSyncRead { address: 132, length: 4, ids: &[1, 2, 7] };

fn fast(
    line: &mut Line,
    now: Instant,
    asked: &[(u8, u16)],
    instruction: Instruction<'_>,
) -> Vec<(u8, Vec<u8>)> {
    let mut reply = FastReply::new();
    reply.expect(asked.iter().map(|&(id, length)| (Id::new(id).unwrap(), length))).unwrap();
    let mut parser = Parser::new();
    for answer in listen(line, now, Address::All, instruction) {
        parser.push(&answer.bytes);
    }
    let mut told = Vec::new();
    while let Some(status) = parser.next_part(&mut reply) {
        assert_eq!(status.fault, None);
        told.push((status.id.get(), status.params.to_vec()));
    }
    told
}

#[test]
fn a_fast_read_is_answered_by_all_in_one_frame() {
    let middle = vec![0, 8, 0, 0];
    let all = [(1, 4), (2, 4), (7, 4)];
    assert_eq!(fast(&mut line(), at(0), &all, FAST), all.map(|(id, _)| (id, middle.clone())));
    let records = [[1, 132, 0, 4, 0], [7, 0, 0, 2, 0]].concat();
    let bulk = Instruction::FastBulkRead { records: &records };
    assert_eq!(fast(&mut line(), at(0), &[(1, 4), (7, 2)], bulk), [(1, middle), (7, vec![0xFC, 3])]);
}

#[test]
fn servos_behind_a_silent_one_are_silent_or_continue() {
    let asked = Instruction::FastSyncRead { address: 146, length: 1, ids: &[1, 3, 7] };
    let order = [(1, 1), (3, 1), (7, 1)];
    assert_eq!(fast(&mut line(), at(0), &order, asked), [(1, vec![25])]);
    let mut going_on = Line { followers: FollowerBehaviour::Continue, ..line() };
    assert_eq!(fast(&mut going_on, at(0), &order, asked), [(1, vec![25]), (7, vec![25])]);
    // A dropped reply is treated like a missing servo.
    assert_eq!(fast(&mut injected(&["drop id=2"], 0), at(0), &[(1, 4), (2, 4), (7, 4)], FAST).len(), 1);
}

#[test]
fn bulk_reads_and_writes_reach_each_servo_with_its_own() {
    let mut line = line();
    let written = [[1, 65, 0, 1, 0, 1].as_slice(), &[7, 31, 0, 1, 0, 60]].concat();
    assert_eq!(say(&mut line, Address::All, Instruction::BulkWrite { records: &written }), []);
    assert_eq!(line.servos[0].read(65, 1), Ok(&[1][..]));
    assert_eq!(line.servos[2].read(31, 1), Ok(&[60][..]));
    let asked = [[7, 31, 0, 1, 0], [1, 132, 0, 4, 0]].concat();
    let answers = say(&mut line, Address::All, Instruction::BulkRead { records: &asked });
    assert_eq!(answers, [(7, None, 1), (1, None, 4)]);
}

#[test]
fn a_registered_write_waits_for_the_action_instruction() {
    let mut line = line();
    let told = Instruction::RegWrite { address: 65, data: &[1] };
    assert_eq!(say(&mut line, one(1), told), [(1, None, 0)]);
    assert_eq!(say(&mut line, one(7), told), [(7, None, 0)]);
    let leds =
        |line: &Line| line.servos.iter().map(|servo| servo.read(65, 5).unwrap()[0]).collect::<Vec<_>>();
    assert_eq!(leds(&line), [0, 0, 0]);
    assert_eq!(line.servos[0].read(69, 1), Ok(&[1][..]));
    assert_eq!(say(&mut line, Address::All, Instruction::Action), []);
    assert_eq!(leds(&line), [1, 0, 1]);
    assert_eq!(say(&mut line, one(1), Instruction::Action), [(1, Some(Fault::Instruction), 0)]);
    let wrong = Instruction::RegWrite { address: 65, data: &[9] };
    assert_eq!(say(&mut line, one(1), wrong), [(1, Some(Fault::Range), 0)]);
}

#[test]
fn a_backup_brings_the_eeprom_back_and_a_factory_reset_the_box() {
    let mut line = line();
    let limit = |line: &Line| line.servos[0].read(31, 1).unwrap()[0];
    let put = |line: &mut Line, value| say(line, one(1), Instruction::Write { address: 31, data: &[value] });
    assert_eq!(say(&mut line, one(1), Instruction::Backup(Backup::Restore)), [(1, Some(Fault::Result), 0)]);
    put(&mut line, 60);
    assert_eq!(say(&mut line, one(1), Instruction::Backup(Backup::Store)), [(1, None, 0)]);
    assert_eq!(line.servos[0].read(147, 1), Ok(&[1][..]));
    put(&mut line, 50);
    assert_eq!(say(&mut line, one(1), Instruction::Backup(Backup::Restore)), [(1, None, 0)]);
    assert_eq!(limit(&line), 60);
    assert_eq!(say(&mut line, one(1), Instruction::Ping), [], "it begins anew");
    line.advance(at(400));
    assert_eq!(say(&mut line, Address::All, Instruction::FactoryReset(Reset::All)), []);
    assert_eq!(limit(&line), 60, "all servos at once keep what they have");
    line.advance(at(900));
    let reset = Instruction::FactoryReset(Reset::KeepId);
    assert_eq!(listen(&mut line, at(900), one(7), reset).len(), 1);
    line.advance(at(1400));
    assert_eq!(line.servos[2].baud(), 57_600);
    assert_eq!((line.servos[2].id(), line.servos[0].id()), (7, 1));
}

#[test]
fn a_servo_at_another_baud_rate_receives_nothing() {
    let mut line = line();
    say(&mut line, one(2), Instruction::Write { address: 8, data: &[6] });
    line.baud = Some(57_600);
    assert_eq!(ids(&listen(&mut line, at(1), Address::All, Instruction::Ping)), [1, 7]);
    line.baud = Some(4_000_000);
    assert_eq!(ids(&listen(&mut line, at(1), Address::All, Instruction::Ping)), [2]);
    line.baud = Some(1_000_000);
    assert_eq!(listen(&mut line, at(1), Address::All, Instruction::Ping), []);
}

#[test]
fn a_secondary_identifier_is_obeyed_in_silence() {
    let mut line = line();
    say(&mut line, one(7), Instruction::Write { address: 12, data: &[1] });
    assert_eq!(say(&mut line, one(1), Instruction::Write { address: 65, data: &[1] }), [(1, None, 0)]);
    assert_eq!(line.servos[2].read(65, 1), Ok(&[1][..]));
}

/// A few seconds of instructions, and all replies to them.
fn play(line: &mut Line) -> Vec<Vec<Reply>> {
    let told = Instruction::SyncWrite { address: 116, length: 4, records: &[1, 0, 9, 0, 0] };
    (0..400)
        .map(|step| {
            let instruction = [SYNC, FAST, told, Instruction::Ping][step % 4];
            listen(line, at(5 * u64::try_from(step).unwrap()), Address::All, instruction)
        })
        .collect()
}

#[test]
fn the_same_seed_and_the_same_instructions_make_the_same_faults() {
    let faults: Vec<String> = FaultKind::ALL
        .into_iter()
        .map(|kind| {
            let held = [
                FaultKind::Baud,
                FaultKind::DuplicateId,
                FaultKind::HangUp,
                FaultKind::StoppedClock,
                FaultKind::Blocked,
                FaultKind::Sag,
            ];
            let held = held.contains(&kind);
            let when = if held { "from=1s for=300ms" } else { "p=0.05" };
            let when = if kind == FaultKind::BrownOut { "at=200ms" } else { when };
            format!("{} {when}", kind.name())
        })
        .collect();
    let faults: Vec<&str> = faults.iter().map(String::as_str).collect();
    let run = |seed, faults: &[&str]| {
        let mut line = injected(faults, seed);
        let played = play(&mut line);
        line.hangs_up(at(1100));
        (played, line.injector.injected)
    };
    let (first, counts) = run(7, &faults);
    assert_eq!(run(7, &faults), (first.clone(), counts));
    assert_ne!(run(8, &faults).0, first);
    for (kind, count) in counts.iter() {
        assert!(count > 0, "{kind:?} never happened");
    }
    // Disabled faults have no effect.
    assert_eq!(run(7, &[]), (play(&mut line()), FaultCounts::default()));
    // An additional fault does not change when the others occur.
    let flips = |faults: &[&str]| run(7, faults).1.of(FaultKind::Flip);
    assert_eq!(flips(&["flip id=7 p=0.3"]), flips(&["noise p=0.2", "flip id=7 p=0.3"]));
}

#[test]
fn a_fault_happens_in_its_window_to_its_servos() {
    let mut line = injected(&["drop bus=torso id=2,7 from=10ms for=10ms", "drop bus=face id=1"], 0);
    for (ms, heard) in [(0, &[1, 2, 7][..]), (9, &[1, 2, 7]), (10, &[1]), (19, &[1]), (20, &[1, 2, 7])] {
        assert_eq!(ids(&listen(&mut line, at(ms), Address::All, SYNC)), heard, "{ms}");
    }
    assert_eq!(line.injector.injected.of(FaultKind::Drop), 4);
    let mut once = injected(&["drop id=2 at=5ms"], 0);
    let heard: Vec<_> = [0, 6, 7].map(|ms| ids(&listen(&mut once, at(ms), Address::All, SYNC)).len()).into();
    assert_eq!(heard, [3, 2, 3]);
}

#[test]
fn every_kind_of_corrupt_reply_matches_its_name() {
    let whole = listen(&mut line(), at(0), Address::All, SYNC);
    let spoiled = |fault| listen(&mut injected(&[fault], 3), at(0), Address::All, SYNC);
    let of = |answers: &[Reply], id| answers.iter().find(|answer| answer.id == id).unwrap().bytes.clone();
    let good = of(&whole, 2);

    let bits = |bytes: &[u8]| bytes.iter().zip(&good).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
    assert_eq!(bits(&of(&spoiled("flip id=2"), 2)), 1);
    let short = of(&spoiled("truncate id=2"), 2);
    assert!(short.len() < good.len() && good.starts_with(&short));
    let lying = of(&spoiled("length id=2"), 2);
    assert!(lying[5] != good[5] && lying.len() == good.len());
    for (fault, length) in [("length id=2 is=0", [0, 0]), ("length id=2 is=65535", [0xFF, 0xFF])] {
        let lying = of(&spoiled(fault), 2);
        assert_eq!((&lying[5..7], lying.len()), (&length[..], good.len()), "{fault}");
        assert_eq!(lying[7..11], good[7..11], "{fault}");
    }
    for (fault, number) in [("error id=2", 7), ("error id=2 is=3", 3)] {
        let wrong = of(&spoiled(fault), 2);
        assert_eq!((wrong[8], &wrong[9..13]), (number, &good[9..13]), "{fault}");
    }
    let noisy = of(&spoiled("noise id=2"), 2);
    assert!(noisy.len() > good.len() && noisy.ends_with(&good));
    assert_eq!(ids(&spoiled("duplicate id=2")), [1, 2, 2, 7]);
    assert_eq!(ids(&spoiled("swap id=1")), [2, 1, 7]);
    let echoed = spoiled("echo");
    assert_eq!((ids(&echoed), &echoed[0].bytes), (vec![254, 1, 2, 7], &encoded(Address::All, SYNC)));
}

#[test]
fn an_error_in_a_fast_reply_costs_no_servo_its_part() {
    let mut line = injected(&["error id=2 is=7"], 0);
    let mut reply = FastReply::new();
    reply.expect([1, 2, 7].map(|id| (Id::new(id).unwrap(), 4))).unwrap();
    let mut parser = Parser::new();
    for answer in listen(&mut line, at(0), Address::All, FAST) {
        parser.push(&answer.bytes);
    }
    let mut told = Vec::new();
    while let Some(status) = parser.next_part(&mut reply) {
        assert_eq!(status.params, [0, 8, 0, 0]);
        told.push((status.id.get(), status.fault));
    }
    assert_eq!(told, [(1, None), (2, Some(Fault::Access)), (7, None)]);
    assert_eq!(line.injector.injected.of(FaultKind::Error), 1);
}

#[test]
fn a_lost_or_damaged_instruction_is_ignored_without_affecting_others() {
    let led = Instruction::SyncWrite { address: 65, length: 1, records: &[1, 1] };
    let both = [encoded(Address::All, led), encoded(Address::All, SYNC)].concat();
    for (fault, kind) in [
        ("drop-instruction at=0s", FaultKind::DropInstruction),
        ("flip-instruction at=0s", FaultKind::FlipInstruction),
    ] {
        for seed in 0..200 {
            let mut line = injected(&[fault], seed);
            let mut answers = Replies::default();
            line.listen(at(0), &both, &mut answers);
            assert_eq!(line.injector.injected.of(kind), 1);
            assert_eq!(line.servos[0].read(65, 1), Ok(&[0][..]), "{fault}, seed {seed}");
            assert_eq!(ids(&answers.list), [1, 2, 7], "{fault}, seed {seed}");
            // The repetition arrives intact.
            line.listen(at(1), &both, &mut answers);
            assert_eq!(line.servos[0].read(65, 1), Ok(&[1][..]), "{fault}, seed {seed}");
        }
    }
    // An instruction that arrives in pieces is one instruction.
    let mut line = injected(&["drop-instruction p=0"], 0);
    let mut answers = Replies::default();
    for byte in &both {
        line.listen(at(0), &[*byte], &mut answers);
    }
    assert_eq!(ids(&answers.list), [1, 2, 7]);
}

#[test]
fn a_late_reply_comes_after_its_timeout() {
    let mut line = injected(&["late id=2 by=30ms at=0s"], 0);
    assert_eq!(ids(&listen(&mut line, at(0), Address::All, SYNC)), [1, 7]);
    assert_eq!(line.arrives_at(), Some(at(30)));
    assert_eq!(ids(&listen(&mut line, at(29), Address::All, SYNC)), [1, 2, 7]);
    assert_eq!(ids(&listen(&mut line, at(31), Address::All, SYNC)), [2, 1, 2, 7]);
    assert_eq!(line.arrives_at(), None);
}

#[test]
fn servo_faults_show_in_their_control_tables() {
    let mut line = injected(&["overload id=1 at=1s", "alert id=2 at=1s", "reboot id=7 at=1s"], 0);
    let all = Address::All;
    let on = Instruction::SyncWrite { address: 64, length: 1, records: &[1, 1, 2, 1, 7, 1] };
    listen(&mut line, at(900), all, on);
    line.advance(at(1000));
    let read = |line: &Line, place: usize, address| line.servos[place].read(address, 1).unwrap()[0];
    // The XM430 switches its torque off on an overload, but not on an input voltage error.
    assert_eq!((read(&line, 0, 70), read(&line, 0, 64)), (1 << 5, 0));
    assert_eq!((read(&line, 1, 70), read(&line, 1, 64)), (1, 1));
    assert_eq!((read(&line, 2, 70), read(&line, 2, 64)), (0, 0));
    assert_eq!(ids(&listen(&mut line, at(1001), all, SYNC)), [1, 2], "the third begins anew");
    let answers = listen(&mut line, at(1401), all, SYNC);
    assert_eq!(answers.iter().map(|answer| answer.bytes[8]).collect::<Vec<_>>(), [0x80, 0x80, 0]);
    // Only a reboot permits torque again.
    let on = Instruction::Write { address: 64, data: &[1] };
    assert_eq!(listen(&mut line, at(1402), one(1), on)[0].bytes[8], 0x87);
    listen(&mut line, at(1403), one(1), Instruction::Reboot);
    assert_eq!(listen(&mut line, at(1810), one(1), on)[0].bytes[8], 0);
}

#[test]
fn a_brown_out_takes_the_bus_away_and_a_double_identifier_garbles() {
    let mut line = injected(&["brown-out from=1s for=500ms"], 0);
    assert_eq!(listen(&mut line, at(999), Address::All, SYNC).len(), 3);
    assert_eq!(listen(&mut line, at(1000), Address::All, SYNC), []);
    assert_eq!(listen(&mut line, at(1899), Address::All, SYNC), []);
    assert_eq!(listen(&mut line, at(1900), Address::All, SYNC).len(), 3);

    // It has rebooted even though the bus was not polled in between.
    let mut unseen = injected(&["brown-out at=1s for=100ms"], 0);
    unseen.advance(at(5000));
    assert_eq!(unseen.servos[0].read(120, 2), Ok(&3500_u16.to_le_bytes()[..]));

    let mut line = injected(&["duplicate-id id=2 for=1s"], 0);
    let mut whole = 0;
    for ms in 1..200 {
        let answers = listen(
            &mut line,
            at(ms),
            Address::All,
            Instruction::SyncRead { address: 120, length: 2, ids: &[2] },
        );
        let mut parser = Parser::new();
        parser.push(&answers[0].bytes);
        whole += u64::from(parser.next_frame().is_some());
    }
    assert!(whole < 150, "{whole} of 199 collided");
    assert_eq!(
        listen(&mut line, at(1001), Address::All, SYNC),
        listen(&mut line, at(1001), Address::All, SYNC)
    );
}

#[test]
fn faults_are_switched_while_it_runs_and_those_that_stay_go_on() {
    let mut line = injected(&["drop id=1 from=10ms"], 0);
    let (one, two): (FaultSpec, FaultSpec) =
        ("drop id=1 from=10ms".parse().unwrap(), "drop id=2".parse().unwrap());
    line.inject(at(9), &[one, two]);
    assert_eq!(ids(&listen(&mut line, at(10), Address::All, SYNC)), [7]);
    line.inject(at(11), &[]);
    assert_eq!(ids(&listen(&mut line, at(11), Address::All, SYNC)), [1, 2, 7]);
}

#[test]
fn a_stopped_servo_clock_continues_from_its_last_value() {
    let mut line = injected(&["stopped-clock id=2 from=100ms for=50ms"], 0);
    let mut ticks = |ms| {
        line.advance(at(ms));
        [0, 1].map(|place: usize| line.servos[place].read(120, 2).unwrap()[0])
    };
    let seen = [99, 100, 149, 150, 160].map(&mut ticks);
    assert_eq!(seen, [[99, 99], [100, 100], [149, 100], [150, 100], [160, 110]]);
    assert_eq!(line.injector.injected.of(FaultKind::StoppedClock), 1);
}

#[test]
fn a_servo_at_a_wrong_speed_misses_each_instruction_once() {
    let mut line = injected(&["baud id=2 for=1s"], 0);
    for ms in 0..3 {
        assert_eq!(ids(&listen(&mut line, at(ms), Address::All, SYNC)), [1, 7]);
    }
    assert_eq!(line.injector.injected.of(FaultKind::Baud), 3);
}

/// The vendor's SDK and LeRobot's motor set-up wait for the status packet after a write.
#[test]
fn a_new_identifier_is_acknowledged_with_the_old_one() {
    let mut line = line();
    let write = Instruction::Write { address: crate::table::ID.address, data: &[9] };
    assert_eq!(say(&mut line, one(2), write), [(2, None, 0)]);
    assert_eq!(say(&mut line, one(2), Instruction::Ping), []);
    assert_eq!(say(&mut line, one(9), Instruction::Ping), [(9, None, 3)]);
}

#[test]
fn obstacles_and_low_supplies_last_as_long_as_their_faults() {
    let mut line = line();
    let faults = ["blocked id=2 from=2s for=3s", "sag id=1-2 from=2s for=3s is=90"];
    line.inject(Instant::EPOCH, &faults.map(|fault| fault.parse().unwrap()));
    line.servos[2].block(true);
    for (ms, blocked, volts) in [(1990, false, 120), (2001, true, 90), (4990, true, 90), (5001, false, 120)] {
        line.advance(at(ms));
        line.advance(at(ms + 1));
        let [one, two, seven] = &line.servos[..] else { panic!("three") };
        assert_eq!(
            (one.is_blocked(), two.is_blocked(), seven.is_blocked()),
            (false, blocked, true),
            "{ms} ms"
        );
        assert_eq!(two.read(144, 2), Ok(&[volts, 0][..]), "{ms} ms");
    }
    assert_eq!(
        (line.injector.injected.of(FaultKind::Blocked), line.injector.injected.of(FaultKind::Sag)),
        (1, 2)
    );
}
