//! The program of the Feather RP2350 from reset on: its USB port, its samples, and the bits of its estimate.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use estimator_core::{ContactEstimator, Decision, Gravity, ImuSample, Stream, Validity};
use gait::sensor::felt_by;
use gait::{GaitName, Ground, Plan, SensorParams, Track};
use lsm6dsox::imu::missing_sample;
use lsm6dsox::register::STATUS_REG;
use lsm6dsox::sim::{Part, PartFault, PartOptions, SharedPart};
use rp2350::{Machine, flash_with};
use wire::dictionary::{SIGNATURE_STORE, index};
use wire::node::{NmtCommand, NmtState};
use wire::uart::{
    Answer, ConfigSet, ContactMessage, Decoder, HealthMessage, Message, NmtRequest, encode,
};
use wire::{Address, Counter, Fault, Faults, Settings, Value};

/// Bytes of a sample: status, temperature, both sensors.
const SAMPLE: usize = 16;

/// Bit of the flag `stale` in a contact.
const STALE: u8 = 1 << 3;

/// Returns the flash with the file that `FOOTFALL_UF2` names, or with a fresh build.
fn flash() -> Vec<u8> {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    let build = || {
        if let Some(given) = std::env::var_os("FOOTFALL_UF2") {
            return flash_with(&std::fs::read(given).expect("the file"));
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let output = Command::new(env!("CARGO"))
            .args(["run", "--locked", "--quiet", "--package", "xtask"])
            .args(["--", "uf2", "--board", "feather-rp2350"])
            .current_dir(root)
            .output()
            .expect("cargo starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let printed = String::from_utf8_lossy(&output.stdout);
        let path = printed.lines().last().expect("the path of the file");
        flash_with(&std::fs::read(path).expect("the file"))
    };
    BUILT.get_or_init(build).clone()
}

/// A specimen of the sensor on a foot that stands for a second, and then walks.
fn walking() -> SharedPart {
    let track = Track::new(&Plan::steady(GaitName::Walk, Ground::Hard, 60.0, 1));
    let felt = move |seconds: f64| felt_by(&track.at(seconds - 1.0), 25.0);
    // The bus takes its time in the controller.
    let options = PartOptions { byte_time_ns: 0, ..SensorParams::LSM6DSOX.specimen(1) };
    Part::with_options(felt, options).shared()
}

fn messages(board: &Machine) -> Vec<Message> {
    let mut decoder = Decoder::new();
    let frames = board.usb.received.iter().filter_map(|byte| decoder.push(*byte));
    frames.flatten().map(|frame| frame.message).collect()
}

fn contacts(messages: &[Message]) -> impl Iterator<Item = &ContactMessage> {
    messages.iter().filter_map(|message| match message {
        Message::Contact(contact) => Some(contact),
        _ => None,
    })
}

fn health(messages: &[Message]) -> &HealthMessage {
    let health = messages.iter().rev().find_map(|message| match message {
        Message::Health(health) => Some(health),
        _ => None,
    });
    health.expect("a state")
}

#[test]
fn board_is_a_foot_on_usb_that_samples_at_1_khz() {
    let mut board = Machine::new(flash(), walking());
    board.run_until(2_000_000);
    assert!(board.usb.is_open());
    assert_eq!(board.usb.texts[..2], ["footfall", "footfall foot"]);
    let messages = messages(&board);
    assert_eq!(health(&messages).faults, Faults::NONE);
    assert_eq!(health(&messages).state, NmtState::Operational);
    let measured = 1_000_000..1_990_000;
    let contacts = contacts(&messages).filter(|c| measured.contains(&c.timestamp.as_micros()));
    assert_eq!(contacts.count(), 990);
    let samples = board.i2c.reads.iter().filter(|read| read.ns >= 1_000_000_000);
    let samples: Vec<_> = samples.filter(|read| read.length == SAMPLE).collect();
    assert!(samples.iter().all(|read| read.first == STATUS_REG.address));
    assert!((998..=1_001).contains(&samples.len()), "{} samples in a second", samples.len());
}

#[test]
fn estimate_has_the_bits_of_the_host_and_settings_survive_a_restart() {
    // Stores a setting: each sample is sent.
    let mut board = Machine::new(flash(), walking());
    let address = |index, subindex| Address::new(index, subindex);
    let set =
        |address, value: Value| Message::ConfigSet(ConfigSet { address, value: value.into() });
    for (us, request) in [
        (900_000, Message::Nmt(NmtRequest(NmtCommand::EnterPreOperational))),
        (1_000_000, set(address(index::UART_STREAMS, 2), Value::U16(1))),
        (1_100_000, set(address(index::STORE, 1), Value::U32(SIGNATURE_STORE))),
    ] {
        board.run_until(us);
        board.send(encode(0, &request).as_bytes());
    }
    board.run_until(1_300_000);
    let answers = messages(&board).into_iter().filter_map(|message| match message {
        Message::ConfigResponse(response) => Some(response.answer),
        _ => None,
    });
    assert_eq!(answers.collect::<Vec<_>>(), [Answer::Done; 2]);
    let flash = board.into_flash();

    // The sensor answers once the port is open, so that all samples are received.
    let part = walking();
    part.inject(PartFault::MisoStuckHigh);
    let mut board = Machine::new(flash, part.clone());
    board.run_until(300_000);
    assert!(board.usb.is_open());
    part.with(Part::clear_faults);
    board.run_until(6_000_000);
    let messages = messages(&board);
    let samples = messages.iter().filter_map(|message| match message {
        Message::Raw(raw) => Some((raw.timestamp, raw.to_si())),
        _ => None,
    });
    let samples: BTreeMap<_, _> = samples.collect();
    let stream = Stream::new(1_000.0, Gravity::Included).expect("a rate");
    let config = Settings::default().params().params.validate().expect("the defaults");
    let mut estimator = ContactEstimator::new(&config, stream);
    let (mut compared, mut stable) = (0, 0);
    for contact in contacts(&messages) {
        let sample = samples.get(&contact.timestamp).copied();
        compared += u32::from(sample.is_some() && !contact.status.has_fault());
        // A tick may come before the sensor's first reading. It then sends no sample.
        let is_stale = contact.flags & STALE != 0;
        let validity = if is_stale { Validity::Stale } else { Validity::Invalid };
        let missing = ImuSample { validity, ..missing_sample(contact.timestamp) };
        let sample = sample.unwrap_or(missing);
        let expected = ContactMessage::new(&estimator.update(&sample, None), Faults::NONE);
        // A fault voids the probabilities.
        if !contact.status.has_fault() {
            assert_eq!(*contact, ContactMessage { status: contact.status, ..expected });
        }
        stable += u32::from(contact.status.decision() == Decision::Stable);
    }
    assert!(compared > 5_000 && stable > 1_000, "{compared} compared, {stable} stable");
    let state = health(&messages);
    for counter in [Counter::LateTicks, Counter::UartDropped] {
        assert_eq!(state.counters.get(counter), 0, "{counter:?}");
    }
    assert_eq!(state.faults, Faults::NONE);
    assert!(messages.iter().any(|message| match message {
        Message::Health(health) => health.faults.contains(Fault::SensorWrongId),
        _ => false,
    }));
}
