//! The demo's CAN log in the formats of other programs, and damaged logs.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::LazyLock;

use crate::environment;
use feet::decode::row::write_row;
use feet::decode::{ContactRow, DecodeError, DecodeNotice, Decoded, KnownFeet, decode};
use flate2::Compression;
use flate2::write::GzEncoder;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, simulate};
use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use simulated_robot::walk::walk;
use tempfile::TempDir;

/// Log of `candump -l` that the demo writes.
static DEMO: LazyLock<String> = LazyLock::new(|| {
    let simulation = simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    walk(&simulation).expect("valid settings").can_log()
});

fn decoded(bytes: &[u8]) -> Decoded {
    decode(bytes, "file", &KnownFeet::default()).expect("a log")
}

/// A row without the fields that other log formats name differently.
fn bare(row: &ContactRow) -> String {
    let row = ContactRow { received: None, common: None, interface: None, ..row.clone() };
    let mut cells = Vec::new();
    write_row(&row, &mut cells).expect("memory");
    String::from_utf8(cells).expect("a table")
}

/// Times of reception since the first row, µs.
fn received(rows: &[ContactRow]) -> Vec<i64> {
    let micros = |row: &ContactRow| row.received.expect("a time").as_micros() as i64;
    let first = rows.first().map_or(0, micros);
    rows.iter().map(|row| micros(row) - first).collect()
}

/// Asserts that the log decodes to the rows of the demo, with times of reception to `resolution_us`.
fn assert_is_the_demo(bytes: &[u8], name: &str, resolution_us: i64) {
    let (expected, got) = (decoded(DEMO.as_bytes()), decoded(bytes));
    assert_eq!(got.rows.len(), expected.rows.len(), "{name}");
    for (got, expected) in got.rows.iter().zip(&expected.rows) {
        assert_eq!(bare(got), bare(expected), "{name}");
    }
    let times = received(&got.rows).into_iter().zip(received(&expected.rows));
    for (got, expected) in times {
        let error = (got - expected).abs();
        assert!(error <= resolution_us, "{name}: {got} for {expected}");
    }
    let mut frames = got.report.frames;
    frames.remove("events");
    assert_eq!(frames, expected.report.frames, "{name}");
    assert!(got.report.problems.is_empty(), "{name}");
    assert_eq!(got.report.missing, 0, "{name}");
}

fn refusal(bytes: &[u8]) -> String {
    match decode(bytes, "file", &KnownFeet::default()) {
        Err(error @ (DecodeError::Foreign { .. } | DecodeError::Unrecognised(_))) => {
            error.to_string()
        }
        other => panic!("{other:?}"),
    }
}

fn folder_with_the_log() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary directory");
    fs::write(folder.path().join("can.log"), &*DEMO).expect("a file");
    folder
}

fn contents(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn python_can_formats_are_decoded_or_named_with_an_alternative() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    let folder = folder_with_the_log();
    let output = Command::new(python)
        .arg(workspace().join("host-tests/tests/python/can_logs.py"))
        .args([&folder.path().join("can.log"), folder.path()])
        .output()
        .expect("the interpreter starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    for (name, resolution_us) in [
        // The resolution of Python's float timestamps in 2021 is a quarter of a microsecond.
        ("python_can.log", 1),
        ("from_blf.log", 1),
        ("from_asc.log", 1),
        ("from_csv.log", 1),
        // TRC has a resolution of a microsecond, from the start of a millisecond.
        ("from_trc.log", 2),
    ] {
        assert_is_the_demo(&contents(folder.path(), name), name, resolution_us);
    }
    for (name, what) in [
        ("python_can.blf", "file is a BLF log of a CAN bus, which"),
        ("python_can.asc", "file is neither a log of candump"),
        ("python_can.csv", "file is neither a log of candump"),
        ("python_can.trc", "file is a PEAK TRC log of a CAN bus, which"),
    ] {
        let said = refusal(&contents(folder.path(), name));
        assert!(said.starts_with(what), "{said}");
        assert!(said.ends_with("can_logconvert file can.log"), "{said}");
    }
}

/// Output of a can-utils program for the log on its standard input; `None` if the program is not installed.
fn can_utils(program: &str, arguments: &[&str], input: &Path) -> Option<Vec<u8>> {
    let output = Command::new(program)
        .args(arguments)
        .stdin(File::open(input).expect("the log"))
        .stderr(Stdio::null())
        .output()
        .ok()?;
    assert!(output.status.success(), "{program}");
    Some(output.stdout)
}

#[test]
fn candump_logs_of_can_utils_are_decoded() {
    let folder = folder_with_the_log();
    let log = folder.path().join("can.log");
    let Some(printed) = can_utils("log2long", &[], &log) else {
        return unmet("can-utils, with log2asc and log2long, is not installed");
    };
    assert_is_the_demo(&printed, "log2long", 0);
    let asc = can_utils("log2asc", &["can0"], &log).expect("it is beside log2long");
    let path = folder.path().join("can.asc");
    fs::write(&path, asc).expect("a file");
    let back = can_utils("asc2log", &[], &path).expect("it is beside log2long");
    assert_is_the_demo(&back, "asc2log", 0);
}

/// The demo's log as printed by `candump`, with these times and this text beside the interface.
fn printed(time: impl Fn(u64, u64) -> String, direction: &str) -> String {
    let mut before = None;
    let mut text = String::new();
    for line in DEMO.lines() {
        let (at, rest) = line.split_once(' ').expect("a time");
        let digits: String = at.chars().filter(char::is_ascii_digit).collect();
        let micros: u64 = digits.parse().expect("a time");
        let (id, data) = rest.split_once(' ').expect("a frame").1.split_once('#').expect("a frame");
        let bytes: Vec<_> = (0..data.len() / 2).map(|k| &data[2 * k..2 * k + 2]).collect();
        let before = before.replace(micros).unwrap_or(micros);
        text += &format!(
            "{}  can0{direction}  {id}   [{}]  {}\n",
            time(micros, before),
            bytes.len(),
            bytes.join(" ")
        );
    }
    text
}

fn brackets(micros: u64) -> String {
    format!(" ({:03}.{:06})", micros / 1_000_000, micros % 1_000_000)
}

#[test]
fn candump_output_is_decoded_with_each_kind_of_time() {
    let start = 1_609_459_200_000_140;
    for direction in ["", "  RX - -", "  TX B E"] {
        for log in [
            printed(|at, _| brackets(at), direction),
            printed(|at, _| brackets(at - start), direction),
            printed(|at, before| brackets(at - before), direction),
        ] {
            assert_is_the_demo(log.as_bytes(), &log[..60], 0);
            assert_is_the_demo(log.replace('\n', "\r\n").as_bytes(), &log[..60], 0);
        }
        let log = printed(|_, _| String::new(), direction);
        let (expected, got) = (decoded(DEMO.as_bytes()), decoded(log.as_bytes()));
        let pairs = got.rows.iter().zip(&expected.rows);
        for (got, expected) in pairs {
            assert_eq!(bare(got), bare(expected));
            assert_eq!((got.received, got.common), (None, None));
        }
        assert_eq!(got.report.rows, expected.report.rows);
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

#[test]
fn a_truncated_compressed_log_is_decoded_up_to_its_end() {
    let whole = gzip(DEMO.as_bytes());
    assert_is_the_demo(&whole, "gzip", 0);
    let cut = decoded(&whole[..whole.len() / 2]);
    assert!(cut.report.rows > 5000, "{}", cut.report);
    assert_eq!(cut.report.problems["compressed_data_cut_off"], 1);
    assert!(cut.notices.contains(&DecodeNotice::CutOff));
}

/// A few frames of every kind in every format, with the expected counts.
fn small() -> Vec<(&'static str, String)> {
    let candump = "\
        (1609459200.000111) can0 191#FFFF80800C0007D8\n\
        (1609459200.000222) can1 191#FFFF80800C000757\n\
        (1609459200.000333) can0 18DAF110#0102\n\
        (1609459200.000444) can0 711#R\n\
        (1609459200.000555) can0 191##1000102030405060708090A0B\n\
        (1609459200.000666) can0 20000004#0004000000000000\n\
        (1609459200.001111) can0 191#FFFF8080700008D9\n\
        (1609459200.001222) can0 7FF#00\n";
    let terminal = "\
        \u{20}(000.000000)  can0  191   [8]  FF FF 80 80 0C 00 07 D8\n\
        \u{20}(000.000111)  can1  191   [8]  FF FF 80 80 0C 00 07 57\n\
        \u{20}(000.000222)  can0  18DAF110   [2]  01 02\n\
        \u{20}(000.000333)  can0  711   [0]  remote request\n\
        \u{20}(000.000444)  can0  191  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n\
        \u{20}(000.000555)  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\n\
        \u{20}(000.001000)  can0  191   [8]  FF FF 80 80 70 00 08 D9\n\
        \u{20}(000.001111)  can0  7FF   [1]  00\n";
    vec![("candump -l", candump.to_owned()), ("candump", terminal.to_owned())]
}

#[test]
fn every_format_counts_the_same_frames_with_any_line_ending() {
    for (name, log) in small() {
        for log in [log.clone(), log.replace('\n', "\r\n"), log.trim_end().to_owned()] {
            let Decoded { rows, report, .. } = decoded(log.as_bytes());
            assert_eq!(rows.len(), 3, "{name}");
            // The times are one millisecond apart, with a frame of another foot between them.
            let times = [&rows[0], &rows[2]].map(|row| row.timestamp.as_micros());
            assert_eq!(times, [120, 1120], "{name}");
            for kind in ["extended", "remote", "fd", "error_frame", "not_of_a_foot"] {
                assert_eq!(report.frames.get(kind), Some(&1), "{name}: {kind}");
            }
            assert_eq!(report.frames.values().sum::<u64>(), 8, "{name}");
            assert!(report.problems.is_empty() && report.missing == 0, "{name}: {report}");
        }
    }
}
