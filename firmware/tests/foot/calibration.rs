//! The foot learns its limits of stillness while it walks; the learnt values are kept over power-off, cleared on
//! request, and never lost otherwise.

use std::cell::RefCell;

use crate::bench::{Bench, MS, Run, run};
use crate::storage::{Flash, load, stored};
use ::storage::Origin;
use estimator_core::any::Method;
use estimator_core::{Flag, Learning, Learnt};
use firmware::exchange::{Input, Reloaded, Request};
use gait::sensor::felt_by;
use gait::{GaitName, Ground, Plan, SensorParams, Track};
use lsm6dsox::sim::SharedPart;
use wire::dictionary::{SIGNATURE_STORE, index};
use wire::node::{CalibrationState, NmtCommand};
use wire::uart::{Answer, ConfigGet, Message};
use wire::{Address, Settings, Value};

const COMMAND: Address = Address::new(index::CALIBRATION, 1);
const STATE: Address = Address::new(index::CALIBRATION, 2);
const THRESHOLD: Address = Address::new(index::DECISION, 1);
const METHOD: Address = Address::new(index::ESTIMATION, 1);
const LEARNING: Address = Address::new(index::ESTIMATION, 2);
const KEEP: Value = Value::U8(1);
const FORGET: Value = Value::U8(2);

/// Time after which a walk is settled, ms.
const SETTLED_MS: u64 = 10_000;

fn walk(seconds: f64, seed: u64) -> Track {
    Track::new(&Plan::steady(GaitName::Walk, Ground::Hard, seconds, seed))
}

/// A foot that stands for two seconds and then walks.
fn walking(seconds: f64, seed: u64) -> SharedPart {
    let track = walk(seconds, seed);
    SensorParams::LSM6DSOX.mounted(move |t, celsius| felt_by(&track.at(t), celsius), 0.0, seed)
}

fn ask(bench: &mut Bench, address: Address) {
    bench.ask(&Message::ConfigGet(ConfigGet { address }));
}

fn state(state: CalibrationState) -> Answer {
    Answer::Value(Value::U8(state.code()).into())
}

fn is_settling(bench: &Bench) -> bool {
    bench.foot.estimate().flags.contains(Flag::Settling)
}

/// An action after a tick.
type Act<'a> = (u64, &'a dyn Fn(&mut Bench));

/// Time after which the sensor, which each run restarts, has started, ms.
const AT_WORK: u64 = 1000;

/// Runs for `ms` ticks and performs an action after some of them. Returns all answers, in order.
fn scripted(part: &SharedPart, bench: &mut Bench, ms: u64, script: &[Act<'_>]) -> Vec<Answer> {
    let mut answers = Vec::new();
    let mut ticks = 0;
    run(Run::default(), part, bench, ms * MS, |bench, _, _| {
        answers.extend(bench.answers());
        let due = script.iter().filter(|(at, _)| *at == ticks);
        due.for_each(|(_, action)| action(bench));
        ticks += 1;
    });
    answers
}

/// A foot after a settled walk, in pre-operational state, and its part.
fn walked(settings: Settings, seed: u64) -> (SharedPart, Bench) {
    let part = walking(60.0, seed);
    let mut bench = Bench::new(settings);
    let open = |bench: &mut Bench| bench.command(NmtCommand::EnterPreOperational);
    scripted(&part, &mut bench, SETTLED_MS, &[(SETTLED_MS - 10, &open)]);
    assert!(!is_settling(&bench));
    (part, bench)
}

/// Settings with the values learnt by a foot that walked with this seed.
fn learnt_from(seed: u64) -> Settings {
    let (_, bench) = walked(Settings::default(), seed);
    let mut settings = Settings::default();
    let kept = settings.set_learnt(Some(bench.foot.learnt()));
    assert_eq!(kept, Ok(()));
    settings
}

/// Learnt values before the seconds.
const CLASSES: usize = 3;

/// The learnt values without the seconds.
fn classes(learnt: Learnt) -> [f32; CLASSES] {
    let numbers = learnt.to_array();
    std::array::from_fn(|i| numbers[i])
}

#[test]
fn kept_values_apply_from_the_first_sample_after_power_off() {
    let (part, mut bench) = walked(Settings::default(), 5);
    let before = RefCell::new(Learnt::default());
    let keep = |bench: &mut Bench| bench.set(COMMAND, KEEP);
    // The next tick executes the command after its sample.
    let note = |bench: &mut Bench| *before.borrow_mut() = bench.foot.learnt();
    let ask_state = |bench: &mut Bench| ask(bench, STATE);
    let doubtless = |bench: &mut Bench| {
        let flags = bench.foot.estimate().flags;
        assert!(!flags.are_doubt(), "the estimator was made again: {flags:?}");
    };
    let store = |bench: &mut Bench| {
        let store = Address::new(index::STORE, 1);
        bench.set(store, Value::U32(SIGNATURE_STORE));
    };
    let flash = RefCell::new(None);
    let write = |bench: &mut Bench| {
        let Some(Request::Store(settings, _)) = bench.ports.try_next_request() else {
            panic!("nothing to store");
        };
        *flash.borrow_mut() = Some(stored(Flash::blank(), &settings));
        assert!(bench.ports.try_put(Input::Stored(Ok(()))));
    };
    let script: [Act<'_>; 7] = [
        (AT_WORK, &ask_state),
        (AT_WORK + 20, &keep),
        (AT_WORK + 21, &note),
        (AT_WORK + 21, &doubtless),
        (AT_WORK + 22, &doubtless),
        (AT_WORK + 30, &store),
        (AT_WORK + 31, &write),
    ];
    let answers = scripted(&part, &mut bench, AT_WORK + 50, &script);
    assert_eq!(answers, [state(CalibrationState::Settled), Answer::Done, Answer::Done]);
    let kept = before.into_inner();
    assert_eq!(bench.foot.settings().learnt(), Some(kept));

    let (settings, origin) = load(flash.into_inner().expect("it was stored"));
    assert_eq!(origin, Origin::Stored);
    let mut bench = Bench::new(settings);
    assert_starts_with(bench.foot.learnt(), kept);
    let part = walking(10.0, 6);
    let ask_all = |bench: &mut Bench| {
        (2..2 + 1 + Learnt::NUMBERS as u8)
            .for_each(|subindex| ask(bench, Address::new(index::CALIBRATION, subindex)));
    };
    let settled = |bench: &mut Bench| assert!(!is_settling(bench));
    let mut script: Vec<Act<'_>> = vec![(0, &ask_all)];
    script.extend((0..3000).map(|tick| (tick, &settled as &dyn Fn(&mut Bench))));
    let answers = scripted(&part, &mut bench, 3000, &script);
    assert_eq!(answers[0], state(CalibrationState::Settled));
    let numbers: Vec<f32> = answers[1..].iter().map(number).collect();
    for (now, kept) in numbers.iter().zip(classes(kept)) {
        assert!((now - kept).abs() < 5.0e-3, "{now} after {kept}");
    }
}

/// The REAL32 in an answer.
fn number(answer: &Answer) -> f32 {
    match answer {
        Answer::Value(value) => {
            f32::from_le_bytes(value.as_bytes().try_into().expect("four bytes"))
        }
        other => panic!("{other:?}"),
    }
}

/// Asserts that an estimator starts with the classes of `kept`, with a small weight of their seconds.
fn assert_starts_with(learnt: Learnt, kept: Learnt) {
    assert_eq!(classes(learnt), classes(kept));
    assert!(
        learnt.is_settled() && learnt.still_seconds <= kept.still_seconds,
        "{learnt:?} {kept:?}"
    );
}

/// Asserts that an estimator continues from `before`: with its classes, except for one learnt sample.
fn assert_goes_on(learnt: Learnt, before: Learnt) {
    for (now, before) in classes(learnt).into_iter().zip(classes(before)) {
        assert!((now - before).abs() < 5.0e-3, "{now} after {before}");
    }
}

#[test]
fn cleared_values_are_learnt_again() {
    let (part, mut bench) = walked(learnt_from(7), 8);
    let forget = |bench: &mut Bench| bench.set(COMMAND, FORGET);
    let ask_state = |bench: &mut Bench| ask(bench, STATE);
    let forgotten = |bench: &mut Bench| {
        let learnt = bench.foot.learnt();
        // Except for the first samples after it.
        assert!(learnt.still_seconds + learnt.moving_seconds < 0.01, "{learnt:?}");
        assert!(is_settling(bench));
    };
    let script: [Act<'_>; 5] = [
        (AT_WORK, &forget),
        // Answered after the estimate of that tick.
        (AT_WORK + 2, &forgotten),
        (AT_WORK + 2, &ask_state),
        (AT_WORK + 3, &forgotten),
        (SETTLED_MS, &ask_state),
    ];
    let answers = scripted(&part, &mut bench, SETTLED_MS + 10, &script);
    assert_eq!(*bench.foot.settings(), Settings::default());
    let [done, settling, settled] = answers[..] else {
        panic!("{answers:?}");
    };
    assert_eq!(done, Answer::Done);
    assert_eq!(settling, state(CalibrationState::Settling));
    assert_eq!(settled, state(CalibrationState::Settled));
}

#[test]
fn estimator_settings_do_not_change_the_learnt_values() {
    let changes: [(Address, Value); 5] = [
        (THRESHOLD, Value::F32(0.6)),
        (METHOD, Value::U8(1)),
        (METHOD, Value::U8(0)),
        // Lengths are the same along all axes.
        (Address::new(index::MOUNTING, 1), Value::U16(162)),
        (LEARNING, Value::U8(0)),
    ];
    let (part, mut bench) = walked(Settings::default(), 11);
    for (address, value) in changes {
        let before = RefCell::new(Learnt::default());
        let change = |bench: &mut Bench| bench.set(address, value);
        let same = |bench: &mut Bench| {
            // A new estimator first determines up.
            let flags = bench.foot.estimate().flags;
            assert!(flags.contains(Flag::AttitudeNotInitialised), "{address:?}");
            assert_goes_on(bench.foot.learnt(), *before.borrow());
        };
        // The request is answered after that tick's estimate, and the next tick has another estimator.
        let note = |bench: &mut Bench| *before.borrow_mut() = bench.foot.learnt();
        let script: [Act<'_>; 3] = [(AT_WORK, &change), (AT_WORK + 1, &note), (AT_WORK + 2, &same)];
        // Until the foot stands again.
        let answers = scripted(&part, &mut bench, AT_WORK + 2000, &script);
        assert_eq!(answers, [Answer::Done]);
    }
    let params = bench.foot.settings().params();
    assert_eq!((params.params.learnt, params.params.decision.threshold), (None, 0.6));
    assert_eq!(
        (params.method, params.params.learning),
        (Method::SelfCalibrating, Learning::Frozen)
    );
    assert!(bench.foot.learnt().is_settled());
}

#[test]
fn learnt_values_written_by_a_master_take_precedence() {
    let other = learnt_from(12).learnt().expect("something");
    let (part, mut bench) = walked(Settings::default(), 13);
    let numbers = other.to_array().map(Value::F32).into_iter();
    let writes: Vec<_> = (1..)
        .zip(numbers.chain([Learnt::VERSION, other.crc()].map(Value::U32)))
        .map(|(subindex, value)| {
            let address = Address::new(index::LEARNT, subindex);
            move |bench: &mut Bench| bench.set(address, value)
        })
        .collect();
    let mut script: Vec<Act<'_>> = Vec::new();
    for (tick, write) in (0..).zip(&writes) {
        script.push((tick, write));
    }
    let there = |bench: &mut Bench| assert_starts_with(bench.foot.learnt(), other);
    script.push((Learnt::WORDS as u64 + 1, &there));
    let answers = scripted(&part, &mut bench, 20, &script);
    assert_eq!(answers, [Answer::Done; Learnt::WORDS]);
    assert_eq!(bench.foot.settings().learnt(), Some(other));
}

#[test]
fn a_communication_reset_applies_only_changed_learnt_values() {
    let other = learnt_from(16);
    let (part, mut bench) = walked(Settings::default(), 17);
    for (settings, starts_with) in [(Settings::default(), None), (other.clone(), other.learnt())] {
        let before = RefCell::new(Learnt::default());
        let reload = |bench: &mut Bench| {
            *before.borrow_mut() = bench.foot.learnt();
            bench.ports.reload(Reloaded { settings: settings.clone(), origin: Origin::Stored });
        };
        let there = |bench: &mut Bench| {
            let expected = starts_with.unwrap_or(*before.borrow());
            assert_goes_on(bench.foot.learnt(), expected);
        };
        let script: [Act<'_>; 2] = [(AT_WORK, &reload), (AT_WORK + 1, &there)];
        scripted(&part, &mut bench, AT_WORK + 10, &script);
    }
}
