//! Output of the demo's foot, decoded: by this program, and by Python with the DBC.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use estimator_core::{ContactEstimate, Decision, Flag, Saturation, Timestamp, Validity, Vec3};
use feet::decode::{ContactRow, Decoded, KnownFeet, decode};
use firmware::foot::SOUND_TICKS;
use firmware::sampling::{Measurement, SensorFault};
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, Simulation, simulate};
use host_tests::committed::assert_block;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use simulated_robot::board::settings;
use simulated_robot::walk::{Transmission, walk_with};
use wire::pdo::{ACCELERATION_STEP, BIAS_STEP, RATE_STEP, TEMPERATURE_STEP, UNIT_STEP};
use wire::{Fault, Foot};

/// Half a step of 16 and of 8 bits, plus the rounding of f32.
const HALF_P16: f32 = 0.5 / 65_535.0 + 1e-7;
const HALF_P8: f32 = 0.5 / 255.0 + 1e-7;

fn demo_walk() -> Simulation {
    simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED)
}

/// Estimates and output of the demo's foot, with changes to its measurements.
fn sent_with(change: impl FnMut(usize, &mut Measurement)) -> Transmission {
    walk_with(&settings(), &demo_walk(), change).expect("valid settings")
}

/// Estimates and output of the demo's foot.
fn demo() -> Transmission {
    sent_with(|_, _| ())
}

fn decoded(bytes: &[u8]) -> Decoded {
    decode(bytes, "file", &KnownFeet::default()).expect("a recording")
}

fn probabilities(row: &ContactRow) -> [f32; 3] {
    [row.stable, row.tangential, row.vertical]
}

/// Asserts the decided status, which a doubtful estimate does not have.
fn assert_status(row: &ContactRow, estimate: &ContactEstimate) {
    let status = row.status;
    if estimate.flags.are_doubt() {
        assert_eq!(status.decision(), Decision::NotStable);
    } else {
        assert_eq!(status.decision(), estimate.decision);
        assert_eq!(status.phase(), estimate.phase);
    }
    assert_eq!(status.is_valid(), !estimate.flags.are_doubt());
    let saturated = estimate.flags.contains(Flag::Saturated);
    assert_eq!(status.is_saturated(), saturated);
    let starting = [Flag::WindowNotFull, Flag::AttitudeNotInitialised];
    assert_eq!(
        status.is_starting(),
        starting.into_iter().any(|flag| estimate.flags.contains(flag))
    );
    assert!(!status.has_fault());
}

/// Asserts that each number equals the sent one, to half a step and the rounding of an f32 product.
fn assert_near<const N: usize>(got: [f32; N], sent: [f32; N], step: f64) {
    for (got, sent) in got.into_iter().zip(sent) {
        let limit = 0.5 * step as f32 + 1e-6 * sent.abs().max(1.0);
        assert!((got - sent).abs() <= limit, "{got} for {sent}");
    }
}

const fn components(Vec3 { x, y, z }: Vec3) -> [f32; 3] {
    [x, y, z]
}

fn counts(of: &[(&str, u64)]) -> BTreeMap<String, u64> {
    of.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect()
}

#[test]
fn the_serial_line_preserves_times_probabilities_and_states() {
    let demo = demo();
    let Decoded { rows, report, .. } = decoded(&demo.uart);
    assert_eq!(rows.len(), demo.estimates.len());
    for (row, estimate) in rows.iter().zip(&demo.estimates) {
        assert_eq!(row.timestamp, estimate.timestamp);
        let p = estimate.probabilities;
        let sent = [p.stable, p.tangential, p.vertical].into_iter().chain(p.axes.to_array());
        let axes = row.axes.expect("each message has them").to_array();
        for (got, sent) in probabilities(row).into_iter().chain(axes).zip(sent) {
            assert!((got - sent).abs() <= HALF_P16, "{got} for {sent}");
        }
        assert_eq!(row.flags, Some(estimate.flags.bits()));
        assert_status(row, estimate);
        assert_eq!(row.interface, None);
    }
    // The node id arrives with the first health message, for which the contacts before it wait.
    let id = Foot::FrontLeft.default_node_id();
    assert!(rows.iter().all(|row| row.node == Some(id)));
    assert_eq!((report.gaps, report.missing), (0, 0));
    assert!(report.problems.is_empty(), "{:?}", report.problems);
}

#[test]
fn can_preserves_times_probabilities_and_states() {
    let mut temperatures = Vec::new();
    // The demo's sensor neither warms up nor fails. Here it does both, and 25 ms pass once without a sample.
    let demo = sent_with(|k, measurement| {
        let raw = measurement.raw.as_mut().expect("a sound sensor");
        raw.temperature.0 = (k as i16).wrapping_mul(2);
        temperatures.push(raw.temperature.to_celsius());
        let sample = &mut measurement.sample;
        if k >= 13_000 {
            sample.timestamp = Timestamp::from_micros(sample.timestamp.as_micros() + 25_000);
        } else if k >= 10_000 {
            sample.validity = match k / 100 % 4 {
                0 => Validity::Valid,
                1 => Validity::Saturated(Saturation::Accelerometer),
                2 => Validity::Stale,
                _ => Validity::Invalid,
            };
        }
    });
    for flag in Flag::ALL {
        let raised = |estimate: &ContactEstimate| estimate.flags.contains(flag);
        assert!(demo.estimates.iter().any(raised), "{}", flag.name());
    }
    let Decoded { rows, report, notices } = decoded(demo.can_log().as_bytes());
    assert_eq!(rows.len(), demo.estimates.len());
    let sent = demo.estimates.iter().zip(&temperatures);
    for (row, (estimate, temperature)) in rows.iter().zip(sent) {
        let (got, sent) = (row.timestamp.as_micros(), estimate.timestamp.as_micros());
        assert!(got <= sent && sent < got + 10, "{got} µs for {sent} µs");
        let p = estimate.probabilities;
        assert!((row.stable - p.stable).abs() <= HALF_P16);
        assert!((row.tangential - p.tangential).abs() <= HALF_P8);
        assert!((row.vertical - p.vertical).abs() <= HALF_P8);
        if let Some(axes) = row.axes {
            for (got, sent) in axes.to_array().into_iter().zip(p.axes.to_array()) {
                assert!((got - sent).abs() <= HALF_P8);
            }
        }
        // No value while the motion is unknown.
        let known = ![Flag::AttitudeNotInitialised, Flag::Stale, Flag::InvalidSample]
            .into_iter()
            .any(|flag| estimate.flags.contains(flag));
        if let Some(got) = row.orientation {
            let q = estimate.orientation;
            let got = [got.w, got.x, got.y, got.z];
            if known {
                assert_near(got, [q.w, q.x, q.y, q.z], UNIT_STEP);
            } else {
                assert!(got.iter().all(|part| part.is_nan()), "{got:?}");
            }
        }
        for (got, sent, step) in [
            (row.acceleration, estimate.linear_acceleration.0, ACCELERATION_STEP),
            (row.rate, estimate.angular_rate.0, RATE_STEP),
            (row.bias, estimate.gyro_bias.0, BIAS_STEP),
        ] {
            let Some(got) = got.map(components) else {
                continue;
            };
            if known {
                assert_near(got, components(sent), step);
            } else {
                assert!(got.iter().all(|part| part.is_nan()), "{got:?}");
            }
        }
        if let Some(got) = row.temperature {
            assert_near([got], [*temperature], TEMPERATURE_STEP);
        }
        if let Some(flags) = row.flags {
            assert_eq!(flags, estimate.flags.bits());
        }
        assert_status(row, estimate);
    }
    let with = |what: fn(&ContactRow) -> bool| rows.iter().filter(|row| what(row)).count();
    let twentieth = rows.len() / 20;
    assert_eq!(with(|row| row.axes.is_some()), twentieth);
    assert_eq!(with(|row| row.orientation.is_some()), twentieth);
    assert_eq!(with(|row| row.acceleration.is_some()), twentieth);
    assert_eq!(with(|row| row.rate.is_some()), twentieth);
    assert_eq!(with(|row| row.flags.is_some()), rows.len() / 100);
    assert_eq!(with(|row| row.bias.is_some()), rows.len() / 1000);
    assert_eq!(with(|row| row.temperature.is_some()), rows.len() / 1000);
    assert!(with(|row| row.status.decision() == Decision::Stable) > 1000);
    assert_eq!((report.gaps, report.missing), (0, 0));
    assert!(report.problems.is_empty() && notices.is_empty(), "{report}");
}

#[test]
fn the_document_shows_the_output_of_the_demo() {
    let report = decoded(demo().can_log().as_bytes()).report;
    assert_block("docs/reference/formats.md", "decode", &format!("```text\n{report}\n```\n"));
}

#[test]
fn faults_of_the_foot_have_their_time_name_and_detail() {
    let demo = sent_with(|k, measurement| {
        if (3000..3100).contains(&k) {
            measurement.fault = Some(SensorFault { fault: Fault::SensorSilent, detail: 7 });
        }
    });
    let Decoded { rows, report, .. } = decoded(demo.can_log().as_bytes());
    let reported: Vec<_> =
        report.emergencies.iter().map(|e| (e.node, e.code, e.fault.as_str(), e.detail)).collect();
    let name = Fault::SensorSilent.name();
    assert_eq!(reported, [(0x11, 0x7001, name, 7), (0x11, 0, name, 0)]);
    let t = report.emergencies[0].t.expect("there were contacts before it");
    assert!((2.99..=3.0).contains(&t), "{t}");
    let faulty: Vec<_> = rows.iter().filter(|row| row.status.has_fault()).collect();
    // The fault ends with the last of the required consecutive good samples.
    let lasts = 100 + usize::from(SOUND_TICKS) - 1;
    assert_eq!(faulty.len(), lasts);
    for row in faulty {
        assert_eq!(probabilities(row), [0.0; 3]);
        assert_eq!(row.flag_names().last(), Some(&"fault"));
    }
    let on_the_line = decoded(&demo.uart).rows;
    assert_eq!(on_the_line.iter().filter(|row| row.status.has_fault()).count(), lasts);
}

/// Starts of the frames in a recording of the serial line, including a zero, and the end of the last.
fn frames(uart: &[u8]) -> Vec<usize> {
    let between = uart.windows(2).enumerate();
    let begins = between.filter(|(_, pair)| **pair == [0, 0]);
    std::iter::once(0).chain(begins.map(|(at, _)| at + 1)).chain([uart.len()]).collect()
}

#[test]
fn serial_damage_costs_only_the_hit_frames_and_is_counted() {
    let clean = demo().uart;
    let all = decoded(&clean).rows.len() as u64;
    let starts = frames(&clean);
    let mut damaged = clean;
    // The damage begins at the end of the recording, so that earlier positions stay valid. The last frame is cut off.
    damaged.truncate(damaged.len() - 3);
    // Garbage between two frames damages no frame, with or without a terminator.
    let garbage: Vec<u8> = (1..=200).map(|k| (k * 37 % 255) as u8 + 1).collect();
    damaged.splice(starts[9000]..starts[9000], garbage.iter().copied().chain([0]));
    damaged.splice(starts[8000]..starts[8000], garbage);
    // The CRC of this frame of another version is not updated, so the frame counts as damaged.
    damaged[starts[7000] + 2] ^= 2;
    // Ten whole frames are lost.
    damaged.drain(starts[6000]..starts[6010]);
    // Bits flip in frames that are not adjacent.
    for frame in [1000, 2000, 3000, 4000, 5000] {
        damaged[starts[frame] + 20] ^= 0x40;
    }
    let Decoded { rows, report, .. } = decoded(&damaged);
    // Truncated 1, version 1, lost 10, flipped 5.
    let lost = 17;
    let others = ["health", "log"].map(|kind| report.frames[kind]);
    let all_frames = rows.len() as u64 + others.iter().sum::<u64>();
    assert_eq!(all_frames, starts.len() as u64 - 1 - lost);
    assert!(rows.len() as u64 >= all - lost);
    // The truncated frame is at the end, where a gap cannot be detected.
    assert_eq!((report.gaps, report.missing), (7, lost - 1));
    let wrong: u64 = report.problems.values().sum();
    assert_eq!(report.problems["unfinished_frames"], 1);
    assert_eq!(wrong, 9, "{:?}", report.problems);
    // The remaining frames are correct.
    assert!(rows.windows(2).all(|pair| pair[0].timestamp < pair[1].timestamp));
}

#[test]
fn other_versions_and_types_are_distinguished_from_damage() {
    // A frame of version 2, and a frame of type 0x7F, with the CRC-32 of zlib.
    let version = [0x09, 0x02, 0x01, 0x07, 0x01, 0xF1, 0xDB, 0xC9, 0xB2, 0x00];
    let kind = [0x09, 0x01, 0x7F, 0x07, 0x01, 0x45, 0x31, 0x13, 0xFE, 0x00];
    let stream = [&version[..], &demo().uart, &kind].concat();
    let problems = decoded(&stream).report.problems;
    let expected = counts(&[("unknown_version_2", 1), ("unknown_type_0x7F", 1)]);
    assert_eq!(problems, expected);
}

/// A tenth of a second of either format.
fn excerpts() -> [Vec<u8>; 2] {
    let sent = demo();
    let log: String = sent.can_log().lines().take(130).map(|line| format!("{line}\n")).collect();
    [log.into_bytes(), sent.uart[..4000].to_vec()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn arbitrary_files_are_decoded_or_rejected(bytes in vec(any::<u8>(), 0..2000)) {
        if let Err(error) = decode(&bytes, "file", &KnownFeet::default()) {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }

    #[test]
    fn the_counts_of_a_damaged_file_add_up(
        which in 0_usize..2,
        damage in vec((any::<Index>(), any::<u8>()), 1..20),
        cut in any::<Index>(),
    ) {
        static EXCERPTS: LazyLock<[Vec<u8>; 2]> = LazyLock::new(excerpts);
        let mut bytes = EXCERPTS[which].clone();
        for (at, byte) in damage {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        bytes.truncate(cut.index(bytes.len()) + 1);
        if let Ok(Decoded { rows, report, .. }) = decode(&bytes, "file", &KnownFeet::default()) {
            prop_assert_eq!(rows.len(), report.rows);
            let contacts = report.frames.get("contact").copied().unwrap_or(0);
            prop_assert_eq!(rows.len() as u64, contacts - report.duplicates);
            for row in rows {
                prop_assert!(probabilities(&row).into_iter().all(|p| (0.0..=1.0).contains(&p)));
            }
        }
    }
}
