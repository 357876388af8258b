//! The decoder in `c/` is accepted by strict compilers of C and C++, and returns for any bytes the
//! same result as this crate.

#[allow(dead_code, reason = "host-tests run the program of the README")]
mod compare;

use std::ops::RangeInclusive;
use std::path::Path;
use std::{env, fs};

use compare::{Counts, Language, Program, Sanitizers, committed};
use estimator_core::Timestamp;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use wire::foot::cob_id;
use wire::node::NmtState;
use wire::pdo::{Load, Quantity};
use wire::uart::{Answer, ConfigResponse, HealthMessage, Kind, Message, encode};
use wire::{AbortCode, Address, Counter, Counters, Fault, Faults, Pdo, Stage};

/// Number of frames per run.
const FRAMES: usize = 150_000;

/// The decoder with sanitizers, or without if the machine has none and does not require them.
fn sanitized(name: &str, language: Language) -> Program {
    match Program::build(name, &committed(), language, Sanitizers::On) {
        Ok(program) => program,
        Err(error) => {
            let required =
                env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value != "0");
            assert!(!required, "{error}");
            println!("not checked with sanitizers: {error}");
            Program::build(name, &committed(), language, Sanitizers::Off).expect("compilers")
        }
    }
}

/// Frames with every function code, most of them a foot's; some too short or too long, some with
/// identifiers of no foot.
fn can_frames(random: &mut SmallRng) -> Vec<(u32, Vec<u8>)> {
    let bases = Pdo::ALL.map(Pdo::base).into_iter();
    let bases: Vec<u16> = bases.chain([cob_id::EMERGENCY, cob_id::HEARTBEAT, Load::BASE]).collect();
    (0..FRAMES)
        .map(|_| {
            let id = match random.random_range(0..16) {
                0 => random.random(),
                1 => random.random_range(0..0x800),
                _ => {
                    u32::from(bases[random.random_range(0..bases.len())])
                        + random.random_range(0..128)
                }
            };
            let base = (id & 0x780) as u16;
            let length = match (random.random_range(0..8), base) {
                (0, _) => random.random_range(0..13),
                (_, cob_id::HEARTBEAT) => 1,
                (_, Load::BASE) => 4,
                _ => 8,
            };
            let mut data: Vec<u8> = (0..length).map(|_| random.random()).collect();
            // Valid codes, and codes at the ends of the range.
            for byte in &mut data {
                match random.random_range(0..8) {
                    0 => *byte = 0,
                    1 => *byte = 0x80,
                    2 => *byte = 0xFF,
                    3 => *byte = 0x7F,
                    _ => {}
                }
            }
            if base == cob_id::EMERGENCY && length == 8 && random.random_range(0..4) > 0 {
                let fault = Fault::ALL[random.random_range(0..Fault::ALL.len())];
                data[..2].copy_from_slice(&fault.code().to_le_bytes());
                data[3] = fault.number();
            }
            (id, data)
        })
        .collect()
}

/// Frames of the serial line with every type; payloads of the corpus, damaged or not, under a CRC
/// that fits.
fn serial_line(random: &mut SmallRng) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/robustness/corpus/uart");
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("there is a corpus")
        .map(|entry| entry.expect("readable").path())
        .collect();
    files.sort();
    let corpus: Vec<Vec<u8>> =
        files.iter().map(|file| plain(&fs::read(file).expect("readable"))).collect();
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut line = each_value();
    for _ in 0..FRAMES {
        let mut frame = corpus[random.random_range(0..corpus.len())].clone();
        frame.truncate(frame.len().saturating_sub(4));
        for _ in 0..random.random_range(0..4) {
            if !frame.is_empty() {
                let at = random.random_range(0..frame.len());
                frame[at] = random.random();
            }
        }
        match random.random_range(0..12) {
            0 => frame.truncate(random.random_range(0..frame.len() + 1)),
            1 => frame.extend((0..random.random_range(0..160)).map(|_| random.random::<u8>())),
            2 if frame.len() > 1 => {
                frame[1] = Kind::ALL[random.random_range(0..Kind::ALL.len())].code();
            }
            _ => {}
        }
        if random.random_range(0..16) > 0 {
            frame.extend(crc.checksum(&frame).to_le_bytes());
        }
        let mut coded = cobs::encode_vec(&frame);
        if random.random_range(0..16) == 0 {
            let at = random.random_range(0..coded.len());
            coded[at] = random.random();
        }
        line.extend(coded);
        line.push(0);
    }
    line
}

/// A frame with each refusal, stage, fault and counter, because few random frames have them.
fn each_value() -> Vec<u8> {
    let address = Address::new(0x2000, 0);
    let refusals = AbortCode::ALL.map(|abort| {
        let answer = Answer::Refused(abort);
        Message::ConfigResponse(ConfigResponse { address, answer })
    });
    let health = HealthMessage {
        timestamp: Timestamp::from_micros(1),
        stage: Stage::Running,
        state: NmtState::Operational,
        id: None,
        faults: Faults::NONE,
        unknown_faults: 0,
        temperature: Quantity::NONE,
        counters: Counters::default(),
    };
    let stages = Stage::ALL.map(|stage| HealthMessage { stage, ..health });
    let faults =
        Fault::ALL.map(|fault| HealthMessage { faults: Faults::NONE.with(fault), ..health });
    let counters = Counter::ALL.map(|counter| {
        let mut health = health;
        health.counters.add(counter, 0x0102_0304);
        health
    });
    let healths = stages.into_iter().chain(faults).chain(counters);
    let messages = refusals.into_iter().chain(healths.map(Message::Health));
    messages.flat_map(|message| encode(0, &message).as_bytes().to_vec()).collect()
}

/// First frame of a piece of the corpus before coding.
fn plain(bytes: &[u8]) -> Vec<u8> {
    bytes
        .split(|byte| *byte == 0)
        .filter(|coded| !coded.is_empty())
        .find_map(|coded| cobs::decode_vec(coded).ok())
        .unwrap_or_default()
}

/// Compares on frames from this seed, and checks that every kind occurred often.
fn compare(program: &Program, seed: u64) {
    let mut random = SmallRng::seed_from_u64(seed);
    let can = program.compare_can(&can_frames(&mut random));
    let can = can.expect("the same of every CAN frame");
    let kinds = Pdo::ALL.map(|pdo| pdo.name().to_lowercase());
    let kinds = kinds.iter().map(String::as_str);
    let others = ["emergency", "heartbeat", "load"];
    came(&can, kinds.chain(others), 1..=3);
    let serial = program.compare_serial(&serial_line(&mut random));
    let serial = serial.expect("the same of every frame of the serial line");
    let kinds = ["contact", "raw", "health", "log", "nmt"];
    let others = ["config_get", "config_set", "config_response"];
    came(&serial, kinds.into_iter().chain(others), 5..=11);
}

fn came<'a>(counts: &Counts, kinds: impl Iterator<Item = &'a str>, results: RangeInclusive<u8>) {
    let results = results.map(|result| format!("result {result}"));
    for kind in kinds.map(str::to_owned).chain(results) {
        let count = counts.get(&kind).copied().unwrap_or(0);
        assert!(count >= 100, "{kind} came {count} times: {counts:?}");
    }
}

#[test]
fn c_decodes_any_frame_like_this_crate() {
    compare(&sanitized("print_c11", Language::C11), 0xC11);
}

#[test]
fn cpp_decodes_any_frame_like_this_crate() {
    compare(&sanitized("print_cpp17", Language::Cpp17), 0xC17);
}
