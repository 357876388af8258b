//! The program of the Nano RP2040, as its UF2 file, in a third-party emulator of the chip: see
//! `laboratory/nano/README.md`.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::slice;
use std::sync::OnceLock;

use estimator_core::{ContactEstimator, Decision, Gravity, Stream};
use firmware::float;
use host_tests::committed::assert_report;
use host_tests::one_robot::{FEET, OneRobot};
use lsm6dsox::imu::missing_sample;
use results::{Measurement, rounded};
use serde_json::Value as Json;
use tempfile::TempDir;
use wire::dictionary::{SIGNATURE_STORE, index};
use wire::node::{NmtCommand, NmtState};
use wire::uart::{
    Answer, ConfigGet, ConfigSet, ContactMessage, Decoder, Message, NmtRequest, encode,
};
use wire::{Address, Counter, Fault, Faults, Settings, Value};

/// Period of the board's ticks, s.
const TICK_S: f32 = 2.4e-3;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The messages of a board, and the emulator's summary.
struct Run {
    summary: Json,
    messages: Vec<Message>,
}

/// A folder with the emulator's files, and the paths of both programs.
struct Programs {
    uf2: PathBuf,
    part: PathBuf,
}

/// Builds the programs once, and installs the emulator.
fn programs() -> &'static Programs {
    static BUILT: OnceLock<Programs> = OnceLock::new();
    BUILT.get_or_init(|| {
        for line in [
            "run --locked --quiet --package xtask -- uf2",
            "build --locked --package gait --example part",
        ] {
            run(Command::new("cargo").args(line.split(' ')).current_dir(ROOT));
        }
        run(Command::new("npm").args(["ci", "--silent"]).current_dir(emulator()));
        let target = Path::new(ROOT).join("target");
        Programs {
            uf2: target.join("nano-rp2040/thumbv6m-none-eabi/release/foot-nano-rp2040.uf2"),
            part: target.join("debug/examples/part"),
        }
    })
}

fn run(command: &mut Command) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn emulator() -> PathBuf {
    Path::new(ROOT).join("laboratory/nano")
}

/// Runs the board for `seconds`, with its flash in a file of `folder`.
fn board(folder: &TempDir, seconds: u32, options: &[&str]) -> Run {
    let programs = programs();
    let (bytes, flash) = (folder.path().join("bytes"), folder.path().join("flash"));
    let output = Command::new("node")
        .arg("run.mjs")
        .args([Path::new("--uf2"), &programs.uf2, Path::new("--part"), &programs.part])
        .args([Path::new("--output"), &bytes, Path::new("--flash"), &flash])
        .args(["--seconds", &seconds.to_string()])
        .args(options)
        .current_dir(emulator())
        .output()
        .expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut decoder = Decoder::new();
    let bytes = fs::read(&bytes).expect("what the board sent");
    let frames = bytes.iter().filter_map(|byte| decoder.push(*byte));
    Run {
        summary: serde_json::from_slice(&output.stdout).expect("a summary"),
        // The first bytes may be the end of a frame.
        messages: frames.flatten().map(|frame| frame.message).collect(),
    }
}

impl Run {
    fn contacts(&self) -> impl DoubleEndedIterator<Item = &ContactMessage> {
        self.messages.iter().filter_map(|message| match message {
            Message::Contact(contact) => Some(contact),
            _ => None,
        })
    }

    /// Time of the last contact that is stable, s, before a time.
    fn last_stable_before(&self, seconds: f64) -> f64 {
        let times = self.contacts().filter(|contact| contact.status.decision() == Decision::Stable);
        let times = times.map(|contact| contact.timestamp.as_micros() as f64 / 1e6);
        times.filter(|time| *time < seconds).fold(0.0, f64::max)
    }

    /// Number from the summary.
    fn number(&self, place: &str) -> f64 {
        let found = self.summary.pointer(place).and_then(Json::as_f64);
        found.unwrap_or_else(|| panic!("{place}: {}", self.summary))
    }

    /// Returns whether the loader was started.
    fn is_in_loader(&self) -> bool {
        !self.summary["usbBoot"].is_null()
    }

    /// Answers of the foot to requests for settings, in order.
    fn answers(&self) -> Vec<Answer> {
        let all = self.messages.iter().filter_map(|message| match message {
            Message::ConfigResponse(response) => Some(response.answer),
            _ => None,
        });
        all.collect()
    }

    /// The last message about the board's state.
    fn health(&self) -> &wire::uart::HealthMessage {
        let all = self.messages.iter().rev().find_map(|message| match message {
            Message::Health(health) => Some(health),
            _ => None,
        });
        all.expect("a state")
    }

    /// All faults that were active at some time.
    fn faults(&self) -> Vec<Fault> {
        let all = self.messages.iter().filter_map(|message| match message {
            Message::Health(health) => Some(health.faults),
            _ => None,
        });
        all.flat_map(|faults| faults.iter().collect::<Vec<_>>()).collect()
    }
}

/// A request at a time, as an option.
fn at(ms: u32, request: &Message) -> String {
    let request = encode(0, request);
    let digits: String = request.as_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{ms}:{digits}")
}

/// A request for a value at a time, as an option.
fn read_at(ms: u32, index: u16, subindex: u8) -> String {
    at(ms, &Message::ConfigGet(ConfigGet { address: Address::new(index, subindex) }))
}

/// A request that sets a value at a time, as an option.
fn set_at(ms: u32, index: u16, subindex: u8, value: Value) -> String {
    let (address, value) = (Address::new(index, subindex), value.into());
    at(ms, &Message::ConfigSet(ConfigSet { address, value }))
}

/// A command to the foot as a node at a time, as an option.
fn command_at(ms: u32, command: NmtCommand) -> String {
    at(ms, &Message::Nmt(NmtRequest(command)))
}

/// Asserts the state that the page promises at the first light and acceptance of a good board: it runs without a fault, and
/// has not crashed before.
fn assert_good(run: &Run, what: &str) {
    assert_eq!(run.faults(), [], "{what}");
    assert_eq!(run.answers(), [Answer::Value(Value::U16(0).into())], "{what}: a crash");
    assert_eq!(run.health().state, NmtState::Operational, "{what}");
    assert_eq!(run.summary["resets"], Json::Array(vec![]), "{what}");
    // A short flash a second: on once in its second half, not long on and short off.
    let lit = run.number("/led/litMsInLastSecond");
    assert!((30.0..100.0).contains(&lit), "{what}: lit for {lit} ms in the last second");
}

/// Runs a board that stores a setting: it sends each sample.
fn store_raw_stream(folder: &TempDir) {
    let requests = [
        command_at(1_000, NmtCommand::EnterPreOperational),
        set_at(1_200, index::UART_STREAMS, 2, Value::U16(1)),
        set_at(1_500, index::STORE, 1, Value::U32(SIGNATURE_STORE)),
    ];
    let options = requests.each_ref().map(|request| ["--send-at-ms", request]);
    let run = board(folder, 2, options.as_flattened());
    assert_eq!(run.answers(), [Answer::Done; 2]);
}

#[test]
fn soft_floats_have_the_bits_of_the_processor() {
    const EDGES: [u32; 14] = [
        0,
        1,
        0x0040_0000,
        0x007F_FFFF,
        0x0080_0000,
        0x0080_0001,
        0x3380_0000,
        0x3F7F_FFFF,
        0x3F80_0000,
        0x3F80_0001,
        0x4B80_0000,
        0x7F7F_FFFF,
        0x7F80_0000,
        0x7FC0_0000,
    ];
    let check = |a: u32, b: u32| {
        let (x, y) = (f32::from_bits(a), f32::from_bits(b));
        for (name, bits, expected) in
            [("+", float::add(a, b), x + y), ("*", float::multiply(a, b), x * y)]
        {
            let same = bits == expected.to_bits();
            let neither = f32::from_bits(bits).is_nan() && expected.is_nan();
            assert!(same || neither, "{a:08x} {name} {b:08x} is not {bits:08x}");
        }
    };
    for a in EDGES {
        for b in EDGES {
            for signs in [[0, 0], [0, 1], [1, 0], [1, 1]].map(|signs| signs.map(|sign| sign << 31))
            {
                check(a | signs[0], b | signs[1]);
            }
        }
    }
    let mut random = 0x1234_5678_9ABC_DEF0_u64;
    for number in 0..4_000_000_u64 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let (a, b) = (random as u32, (random >> 32) as u32);
        const EXPONENT: u32 = 0x7F80_0000;
        match number % 4 {
            // Exponents that are near.
            0 => check(a, b & !EXPONENT | a.wrapping_add((b >> 27) << 23) & EXPONENT),
            // Differences of nearly equal numbers, of which few bits are left.
            1 => check(a, a ^ 1 << 31 ^ b & 0xFF),
            // Products near one, which may also be subnormal.
            2 => check(
                a,
                b & !EXPONENT
                    | (EXPONENT - (a & EXPONENT)).wrapping_add((b >> 30) << 23) & EXPONENT,
            ),
            _ => check(a, b),
        }
    }
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_adds_and_multiplies_with_the_bits_of_ieee_754() {
    let Programs { uf2, .. } = programs();
    let mut node = Command::new("node");
    node.arg("floats.mjs").arg("--uf2").arg(uf2).arg("--elf").arg(uf2.with_extension(""));
    run(node.current_dir(emulator()));
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_walks_over_usb_with_the_bits_of_the_host() {
    let folder = TempDir::new().expect("a folder");
    store_raw_stream(&folder);
    let run = board(&folder, 20, &["--motion", "walk"]);
    assert_eq!(run.summary["resets"], Json::Array(vec![]));
    assert_eq!(run.summary["usb"]["product"], "footfall foot");
    let busy = run.summary["busyShare"].as_f64().expect("a share");
    assert!(busy < 0.60, "load {busy}");
    let mut result = Measurement::new(
        "nano",
        "A walk of 20 s on the emulated Nano RP2040, which also sends its raw samples.",
    )
    .measured_by("cargo test -p measurements nano_walks -- --ignored")
    .tolerance("value", 0.05);
    let cycles = busy * run.number("/clockMhz") * 1.0e6 * f64::from(TICK_S);
    let rate = run.contacts().count() as f64 / run.number("/seconds");
    for (quantity, value, unit) in [
        ("processor busy", rounded(100.0 * busy, 1), "%"),
        (
            "cycles of a sample, frames and interrupts included",
            rounded(cycles / 1.0e3, 0),
            "thousand",
        ),
        ("contacts a second, from power-up on", rounded(rate, 0), ""),
    ] {
        let row = [("quantity", quantity.into()), ("value", value.into()), ("unit", unit.into())];
        result.row(row);
    }
    result.assert_current();
    let samples = run.messages.iter().filter_map(|message| match message {
        Message::Raw(raw) => Some((raw.timestamp, raw.to_si())),
        _ => None,
    });
    let samples: BTreeMap<_, _> = samples.collect();
    let stream = Stream::new(1.0 / TICK_S, Gravity::Included).expect("a rate");
    let config = Settings::default().params().params.validate().expect("the defaults");
    let mut estimator = ContactEstimator::new(&config, stream);
    let (mut compared, mut stable) = (0, 0);
    for contact in run.contacts() {
        let sample = samples.get(&contact.timestamp).copied();
        compared += u32::from(sample.is_some());
        let sample = sample.unwrap_or_else(|| missing_sample(contact.timestamp));
        let expected = ContactMessage::new(&estimator.update(&sample, None), Faults::NONE);
        assert_eq!(*contact, ContactMessage { status: contact.status, ..expected });
        stable += u32::from(contact.status.decision() == Decision::Stable);
    }
    assert!(compared > 8_000 && stable > 1_000, "{compared} compared, {stable} stable");
    let counters = run.health().counters;
    for counter in [Counter::LateTicks, Counter::UartDropped, Counter::SensorRestarts] {
        assert_eq!(counters.get(counter), 0, "{counter:?}");
    }
    assert_eq!(run.faults(), []);
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_survives_its_sensor_its_line_and_a_deaf_host() {
    for (options, fault) in [
        (&["--unplug-ms", "4000-5000"][..], Some(Fault::SensorSilent)),
        (&["--stuck-ms", "4000-5000"], Some(Fault::SensorSilent)),
        // The bus answers with the same reading again and again, marked as new.
        (
            &["--fault-at-ms", "4000:frozen", "--fault-at-ms", "5000:clear"],
            Some(Fault::SensorFrozen),
        ),
        (&["--deaf-ms", "4000-5000"], None),
    ] {
        let option = options[0];
        let folder = TempDir::new().expect("a folder");
        let run = board(&folder, 9, &[&["--motion", "stand"], options].concat());
        assert_eq!(run.summary["resets"], Json::Array(vec![]), "{option}");
        // The foot is stable before the fault and after it. Without a sensor it is stable for three ticks at most.
        assert!(run.last_stable_before(4.0) > 3.9, "{option}");
        assert!(run.last_stable_before(9.0) > 8.8, "{option}");
        if let Some(fault) = fault {
            assert!(run.last_stable_before(4.9) < 4.01, "{option}");
            assert!(run.faults().contains(&fault), "{option}: {:?}", run.faults());
        }
        let dropped = run.health().counters.get(Counter::UartDropped);
        assert_eq!(dropped > 0, fault.is_none(), "{option}");
    }
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_takes_defaults_when_its_settings_are_damaged() {
    let folder = TempDir::new().expect("a folder");
    store_raw_stream(&folder);
    let flash = folder.path().join("flash");
    let mut bytes = fs::read(&flash).expect("the flash");
    let start = bytes.len() - 2 * 4096;
    // A bit in the record of settings, behind the mark of the page and the header of the item.
    bytes[start + 64] ^= 0x08;
    fs::write(&flash, bytes).expect("the flash");
    let run = board(&folder, 2, &[]);
    assert!(run.faults().contains(&Fault::ConfigCorrupted), "{:?}", run.faults());
    assert!(!run.messages.iter().any(|message| matches!(message, Message::Raw(_))));
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_starts_from_both_kinds_of_flash() {
    for chip in ["at25sf128a", "is25lp128f"] {
        let folder = TempDir::new().expect("a folder");
        let run = board(&folder, 2, &["--motion", "stand", "--flash-chip", chip]);
        assert_eq!(run.summary["warnings"], Json::Array(vec![]), "{chip}");
        assert!(run.contacts().count() > 400, "{chip}");
    }
}

/// The flash chips are like a family of IS25LP, whose identifiers of 16 bytes differ only in their second half. An
/// AT25SF128A has eight bytes, and nothing that follows them becomes part of the serial number.
#[test]
#[ignore = "full: an emulator of the chip"]
fn nanos_with_equal_first_halves_of_their_ids_are_two_feet() {
    let serial = |chip: &str, id: &str| {
        let folder = TempDir::new().expect("a folder");
        let run = board(&folder, 1, &["--flash-chip", chip, "--unique-id", id]);
        run.summary["usb"]["serial"].as_str().expect("a serial number").to_owned()
    };
    for what_follows in ["", "9d60180102030405", "00000000000000ff"] {
        let id = format!("9d60180102030405{what_follows}");
        assert_eq!(serial("at25sf128a", &id), "9D60180102030405", "{id}");
    }
    assert_eq!(serial("is25lp128f", "9d601801020304059d60180102030405"), "9D60180102030405");
    let first = serial("is25lp128f", "9d601801020304050000000000001234");
    let second = serial("is25lp128f", "9d601801020304050000000000001235");
    assert_eq!((&*first, &*second), ("9D60180102031631", "9D60180102031630"));
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_diagnoses_its_clock_its_flash_and_its_sensor() {
    let folder = TempDir::new().expect("a folder");
    // Reset, clock, both halves of the identifier, fast bus, its errors, WHO_AM_I.
    let parts = [1, 2, 6, 9, 12, 16, 17];
    let requests: Vec<String> = parts
        .into_iter()
        .zip(0..)
        .map(|(subindex, number)| read_at(2_500 + 50 * number, index::DIAGNOSIS, subindex))
        .collect();
    let mut options = vec!["--motion", "stand", "--flash-chip", "is25lp128f"];
    options.extend(["--unique-id", "9d601801020304050000000000001234"]);
    options.extend(requests.iter().flat_map(|request| ["--send-at-ms", request]));
    let expected = [
        Value::U8(1),
        Value::U32(133_000),
        Value::U32(0x9D60_1801),
        Value::U32(0x1234),
        Value::U16(400),
        Value::U16(0),
        Value::U8(0x6C),
    ];
    let answers = board(&folder, 4, &options).answers();
    assert_eq!(answers, expected.map(|value| Answer::Value(value.into())));
}

/// The ROM starts a copied program by the watchdog, and leaves the mask of the light of its loader.
#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_takes_no_copy_for_a_crash() {
    for (reason, scratch) in [("0", "0"), ("0", "64"), ("1", "0"), ("1", "64"), ("2", "64")] {
        let folder = TempDir::new().expect("a folder");
        let crash = read_at(3_500, index::LAST_CRASH, 1);
        let watchdog = ["--reason", reason, "--scratch-0", scratch];
        let others = ["--motion", "stand", "--send-at-ms", &crash];
        let run = board(&folder, 4, [watchdog, others].as_flattened());
        assert_good(&run, &format!("reason {reason}, scratch {scratch}"));
    }
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_takes_a_foreign_filesystem_for_blank() {
    let folder = TempDir::new().expect("a folder");
    // Sectors of a FAT, with a file in them.
    let sector: Vec<u8> =
        b"IMPORTBOARD PY ".iter().copied().cycle().take(300).chain([0; 212]).collect();
    let flash: Vec<u8> = sector.iter().copied().cycle().take(16 << 20).collect();
    fs::write(folder.path().join("flash"), flash).expect("the flash");
    let crash = read_at(3_500, index::LAST_CRASH, 1);
    let run = board(&folder, 4, &["--motion", "stand", "--send-at-ms", &crash]);
    assert_good(&run, "a foreign filesystem");
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_starts_its_loader_at_the_second_of_two_presses() {
    let presses = |presses: &[&str]| {
        let folder = TempDir::new().expect("a folder");
        let options = presses.iter().flat_map(|at| ["--press-at-ms", at]);
        board(&folder, 2, &options.collect::<Vec<_>>()).is_in_loader()
    };
    // Two presses start the loader, as fast as a hand can press or slowly. At the first press the program is not even
    // in RAM.
    assert!(presses(&["300", "400"]));
    assert!(presses(&["300", "700"]));
    assert!(presses(&["1000", "1500"]));
    // A bounce of the contact, a late second press and a single press do not start the loader.
    assert!(!presses(&["300", "303"]));
    assert!(!presses(&["300", "1400"]));
    assert!(!presses(&["50"]));
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_stays_out_of_its_loader_at_resets_of_others() {
    // The second reset is by the watchdog, and the third by a single press.
    let folder = TempDir::new().expect("a folder");
    let options = ["--press-at-ms", "300", "--crash-at-ms", "700", "--press-at-ms", "750"];
    let run = board(&folder, 2, &options);
    assert_eq!(run.summary["resets"].as_array().map(Vec::len), Some(3));
    assert!(!run.is_in_loader());
}

/// The host sets the port to a rate, and closes it at 1.5 s, when the board streams or no longer does.
#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_starts_its_loader_when_its_port_closes_at_1200_baud() {
    let no_streams = [
        command_at(1_000, NmtCommand::EnterPreOperational),
        set_at(1_100, index::UART_STREAMS, 1, Value::U16(0)),
        set_at(1_200, index::UART_STREAMS, 3, Value::U16(0)),
    ];
    let stopped = [command_at(1_000, NmtCommand::StopRemoteNode)];
    for (what, requests) in
        [("streams", &[][..]), ("no streams", &no_streams), ("stopped", &stopped)]
    {
        for baud in [1_200, 115_200] {
            let what = format!("{what}, {baud} baud");
            let folder = TempDir::new().expect("a folder");
            let close = format!("1500:{baud}");
            let mut options = vec!["--close-at-ms", &close];
            options.extend(requests.iter().flat_map(|request| ["--send-at-ms", request]));
            let run = board(&folder, 2, &options);
            assert_eq!(run.is_in_loader(), baud == 1_200, "{what}");
            // The loader does not start before the host has the answers to both of its requests.
            let answered = serde_json::json!({ "baud": baud, "isOpen": false });
            assert_eq!(run.summary["usb"]["answered"], answered, "{what}");
            let last = run.contacts().next_back().expect("a contact").timestamp.as_micros();
            assert_eq!(last > 1_450_000, requests.is_empty(), "{what}: last contact at {last} µs");
        }
    }
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_restarts_after_a_crash_before_its_watchdog_runs() {
    let folder = TempDir::new().expect("a folder");
    // The crash comes in the start of the clocks, after the copy to RAM.
    let run = board(&folder, 2, &["--motion", "stand", "--crash-at-ms", "365"]);
    assert_eq!(run.summary["resets"][0]["reason"], "watchdog forced", "{}", run.summary);
    assert!(run.contacts().count() > 100);
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_sends_once_a_host_has_opened_its_port() {
    let received = |opened: &str| {
        let folder = TempDir::new().expect("a folder");
        board(&folder, 2, &["--open-at-ms", opened]).number("/received")
    };
    // Windows opens a port with DTR low.
    assert_eq!(received("never"), 0.0);
    assert!(received("1000") > 1_000.0);
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_enumerates_behind_a_busy_hub() {
    let folder = TempDir::new().expect("a folder");
    let run = board(&folder, 2, &["--busy-hub"]);
    assert_eq!(run.number("/usb/enumerated"), 1.0);
    assert_eq!(run.number("/usb/maxPowerMa"), 500.0);
    assert_eq!(run.summary["isRadioHeld"], true);
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_recovers_from_a_hung_usb_controller() {
    let folder = TempDir::new().expect("a folder");
    let run = board(&folder, 5, &["--motion", "stand", "--hang-usb-at-ms", "2000"]);
    assert_eq!(run.number("/usb/enumerated"), 2.0);
    assert_eq!(run.summary["resets"], Json::Array(vec![]));
    assert!(run.last_stable_before(5.0) > 4.9);
    // A packet becomes ready in the first 0.8 ms of a frame, plus the time in which it is copied.
    let latest = run.number("/usb/latestArmUs");
    assert!(latest < 810.0, "{latest} µs");
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_waits_for_a_command_after_a_reset_by_one() {
    let folder = TempDir::new().expect("a folder");
    let reset = command_at(1_000, NmtCommand::ResetNode);
    let run = board(&folder, 3, &["--send-at-ms", &reset]);
    assert_eq!(run.summary["resets"][0]["reason"], "watchdog forced");
    assert_eq!(run.health().state, NmtState::PreOperational);
}

/// Boards on a hub, in lock step with programs: `nano/serve.mjs`.
struct Boards {
    child: Child,
    folder: TempDir,
}

impl Boards {
    /// Starts boards that carry the sensor through a motion, and waits for their ports.
    fn start(feet: &[&str], options: &[&str]) -> Self {
        let programs = programs();
        let folder = TempDir::new().expect("a folder");
        let mut child = Command::new("node")
            .arg("serve.mjs")
            .args([Path::new("--uf2"), &programs.uf2, Path::new("--part"), &programs.part])
            .args([Path::new("--links"), folder.path()])
            .args(["--feet", &feet.join(","), "--busy-hub"])
            .args(options)
            .current_dir(emulator())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("node runs");
        let mut line = String::new();
        let output = child.stdout.as_mut().expect("piped");
        BufReader::new(output).read_line(&mut line).expect("a line");
        assert_eq!(line, "ready\n");
        Self { child, folder }
    }

    /// The port of a board, as a source.
    fn source(&self, foot: &str) -> String {
        format!("uart:{}", self.folder.path().join(format!("{foot}.uart")).display())
    }

    /// Ends the boards. Returns their report.
    fn end(mut self) -> Json {
        drop(self.child.stdin.take());
        let mut report = String::new();
        let mut output = self.child.stdout.take().expect("piped");
        output.read_to_string(&mut report).expect("text");
        assert!(self.child.wait().expect("it ends").success());
        serde_json::from_str(&report).expect("a report")
    }
}

/// The program with all features: the one that `FOOTFALL_PROGRAM` names, or a fresh build.
fn footfall() -> PathBuf {
    if let Some(path) = std::env::var_os("FOOTFALL_PROGRAM") {
        return path.into();
    }
    let build = "build --locked --quiet --package footfall-program --features all --target-dir";
    run(Command::new("cargo").args(build.split(' ')).arg("target/full").current_dir(ROOT));
    Path::new(ROOT).join("target/full/debug/footfall")
}

/// The robot of boards at these sources, as `program` reads it.
fn robot<'a>(program: &'a Path, folder: &'a Path, sources: &'a [String]) -> OneRobot<'a> {
    OneRobot { program, folder, sources, rate: f64::from(1.0 / TICK_S) }
}

/// Boards as delivered: the flash contains the file system of an earlier program, the ROM's loader has left its
/// marks, and all boards have the name FL.
#[test]
#[ignore = "full: four emulators of the chip"]
fn four_nanos_on_a_hub_walk_as_one_robot() {
    let flash = tempfile::NamedTempFile::new().expect("a file");
    let sector: Vec<u8> = b"IMPORTBOARD PY ".iter().copied().cycle().take(512).collect();
    fs::write(flash.path(), sector.repeat((16 << 20) / 512)).expect("the flash");
    let flash = flash.path().display().to_string();
    let boards = Boards::start(
        &FEET,
        &["--motion", "walk", "--reason", "1", "--scratch-0", "64", "--flash", &flash],
    );
    let (program, folder) = (footfall(), TempDir::new().expect("a folder"));
    let sources = FEET.map(|foot| boards.source(foot));
    let robot = robot(&program, folder.path(), &sources);
    for foot in &FEET[1..] {
        let (said, _) = robot.footfall(&["foot", &boards.source(foot), "id", foot]);
        assert!(said.contains(foot), "{said}");
    }
    robot.walk();
    let report = boards.end();
    for foot in FEET {
        let board = &report["boards"][foot];
        assert_eq!(board["warnings"], Json::Array(vec![]), "{foot}");
        // The port has gone away only for the board's own resets. The board has never reset a controller as hung.
        let resets = board["resets"].as_array().expect("resets").len() as u64;
        assert_eq!(board["enumerated"], 1 + resets, "{foot}");
    }
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn good_nano_is_accepted_at_the_first_try() {
    let boards =
        Boards::start(&["FL"], &["--motion", "stand", "--reason", "1", "--scratch-0", "64"]);
    let (program, folder) = (footfall(), TempDir::new().expect("a folder"));
    let source = boards.source("FL");
    let robot = robot(&program, folder.path(), slice::from_ref(&source));
    robot.accept(&source);
    assert_eq!(boards.end()["boards"]["FL"]["resets"], Json::Array(vec![]));
}

#[test]
#[ignore = "full: an emulator of the chip"]
fn nano_streams_each_time_its_port_is_opened() {
    let boards = Boards::start(&["FL"], &["--motion", "stand"]);
    let (program, folder) = (footfall(), TempDir::new().expect("a folder"));
    let source = boards.source("FL");
    let robot = robot(&program, folder.path(), slice::from_ref(&source));
    // No time passes for the board between two programs.
    for _ in 0..3 {
        let (lines, said) = robot.footfall(&["monitor", &source, "--seconds", "2"]);
        assert!(lines.contains("417 Hz") && lines.contains("missing 0"), "{lines}{said}");
    }
    boards.end();
}

/// The report is read after a time in which the whole stack has been searched.
#[test]
#[ignore = "full: an emulator of the chip"]
fn report_of_a_nano_is_the_one_on_its_page() {
    let boards = Boards::start(&["FL"], &["--motion", "stand"]);
    let (program, folder) = (footfall(), TempDir::new().expect("a folder"));
    let source = boards.source("FL");
    let robot = robot(&program, folder.path(), slice::from_ref(&source));
    let (watched, said) = robot.footfall(&["monitor", &source, "--seconds", "20"]);
    assert!(watched.contains("417 Hz"), "{watched}{said}");
    let (report, _) = robot.footfall(&["foot", &source, "report"]);
    boards.end();
    for line in [
        "device   footfall, Arduino Nano RP2040 Connect, serial number 0x",
        "faults   none",
        "crash    none",
        "reset    power-up",
        "clock    133000 kHz",
        "chip     50443415 4B210700",
        "sensor   WHO_AM_I 0x6C",
        "bus      200 kHz 0 errors, 300 kHz 0 errors, 400 kHz (in use) 0 errors",
        "settings none",
    ] {
        let has = report.lines().any(|other| other.starts_with(line));
        assert!(has, "no line {line:?} in\n{report}");
    }
    assert!(!report.contains("stack 0 bytes"), "{report}");
    assert_report("docs/start/ten-minutes.md", &report);
}
