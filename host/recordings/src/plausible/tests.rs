use super::*;
use crate::config::parse_axes;
use estimator_core::{AngularRate, ImuSample, SpecificForce, Timestamp, Validity, Vec3};

/// A foot that rests and swings every second for 10 s at 200 Hz, with gravity along z.
fn walk() -> Recording {
    let sample = |k: u64| {
        let phase = (k % 200) as f32 / 200.0;
        let swing = if phase < 0.5 { 0.0 } else { 1.0 };
        let wave = libm::sinf(40.0 * phase);
        RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(5_000 * k),
                specific_force: SpecificForce(Vec3::new(
                    8.0 * swing * wave,
                    3.0 * swing * wave,
                    9.81 + 0.01 * wave + 5.0 * swing * wave,
                )),
                angular_rate: AngularRate(Vec3::new(0.0, 8.0 * swing * wave, 0.001)),
                validity: Validity::Valid,
            },
            load: None,
            label: None,
        }
    };
    Recording {
        name: "walk".to_owned(),
        sample_rate: 200.0,
        gravity: Gravity::Included,
        load_title: String::new(),
        samples: (0..2000).map(sample).collect(),
    }
}

fn with_force(change: impl Fn(Vec3) -> Vec3) -> Recording {
    let mut recording = walk();
    for sample in &mut recording.samples {
        sample.imu.specific_force.0 = change(sample.imu.specific_force.0);
    }
    recording
}

fn with_times(micros: impl Fn(u64) -> u64) -> Recording {
    let mut recording = walk();
    for (k, sample) in (0..).zip(&mut recording.samples) {
        sample.imu.timestamp = Timestamp::from_micros(micros(k));
    }
    recording
}

/// The names of all findings.
fn found(recording: &Recording) -> Vec<&'static str> {
    let is_described = |finding: &Finding| FINDINGS.iter().any(|(name, _)| *name == finding.name());
    assert!(check(recording).iter().all(is_described));
    check(recording).iter().map(Finding::name).collect()
}

fn scaled(by: f32) -> impl Fn(Vec3) -> Vec3 {
    move |force| Vec3::new(force.x * by, force.y * by, force.z * by)
}

#[test]
fn walk_has_no_finding() {
    assert_eq!(found(&walk()), [""; 0]);
}

/// Readings that are updated once in `rows` rows and held in between.
fn held(rows: usize) -> Recording {
    let mut recording = walk();
    for k in 0..recording.samples.len() {
        let read = recording.samples[k - k % rows].imu;
        let imu = &mut recording.samples[k].imu;
        (imu.specific_force, imu.angular_rate) = (read.specific_force, read.angular_rate);
    }
    recording
}

#[test]
fn held_readings_are_reported_with_their_number() {
    let mut recording = held(4);
    // The synthetic foot has noise at rest, too.
    for (k, sample) in (0..).zip(&mut recording.samples) {
        sample.imu.angular_rate.0.x = 1e-3 * (k / 4 % 7) as f32;
    }
    let finding = check(&recording).into_iter().find(|f| f.name() == "held_readings");
    let Some(Finding::HeldReadings { samples, of, rate }) = finding else {
        panic!("{finding:?}");
    };
    // The last three have no reading after them.
    assert_eq!((samples, of), (1497, 2000));
    assert!((rate - 50.0).abs() < 1.0, "{rate}");
}

#[test]
fn perfect_rest_is_not_held() {
    let constant = with_force(|_| Vec3::new(0.0, 0.0, 9.81));
    assert!(!found(&constant).contains(&"held_readings"));
    let mut removed = held(4);
    removed.gravity = Gravity::Removed;
    for sample in &mut removed.samples {
        // At rest in three samples out of four.
        let moves = sample.imu.timestamp.as_micros() / 5_000 % 4 == 0;
        let force = if moves { 3.0 } else { 0.0 };
        sample.imu.specific_force.0 = Vec3::new(force, 0.0, 0.0);
        sample.imu.angular_rate.0 = Vec3::ZERO;
    }
    assert!(!found(&removed).contains(&"held_readings"));
}

#[test]
fn accelerations_in_g_are_found_with_and_without_gravity() {
    let mut recording = with_force(scaled(1.0 / 9.81));
    assert_eq!(found(&recording), ["acceleration_in_g"]);
    recording.gravity = Gravity::Removed;
    assert_eq!(found(&recording), ["acceleration_in_g"]);
}

#[test]
fn gravity_contradicting_its_declaration_is_found() {
    let mut recording = walk();
    recording.gravity = Gravity::Removed;
    assert_eq!(found(&recording), ["gravity_included"]);
    let said = check(&recording)[0].to_string();
    assert!(said.ends_with(" m/s² at rest: --gravity included"), "{said}");
    let mut recording = with_force(|force| Vec3::new(force.x, force.y, force.z - 9.81));
    assert_eq!(found(&recording), ["gravity_removed"]);
    let said = check(&recording)[0].to_string();
    assert!(said.ends_with(" m/s² at rest: --gravity removed"), "{said}");
    recording.gravity = Gravity::Removed;
    assert_eq!(found(&recording), [""; 0]);
}

#[test]
fn sensor_on_its_side_is_found_with_the_axis_up() {
    let up = |recording: &Recording| match check(recording)[..] {
        [Finding::GravityNotAlongZ { up, axes }] => (up, axes_text(&axes)),
        ref other => panic!("{other:?}"),
    };
    let is = |up: &'static str, axes: &str| (up, axes.to_owned());
    let side = with_force(|f| Vec3::new(-f.z, f.y, f.x));
    assert_eq!(up(&side), is("-x", "z,y,-x"));
    let y_up = with_force(|f| Vec3::new(f.x, f.z, -f.y));
    assert_eq!(up(&y_up), is("y", "x,-z,y"));
    assert_eq!(up(&with_force(scaled(-1.0))), is("-z", "x,-y,-z"));
    // A foot may stand at 30°.
    let tilted = with_force(|f| Vec3::new(f.x + 0.5 * f.z, f.y, 0.866 * f.z));
    assert_eq!(found(&tilted), [""; 0]);
}

#[test]
fn wrong_mounting_is_replaced_by_a_right_one() {
    // y of the sensor is up, but was declared as x of the foot.
    let wrong = parse_axes("y,z,x").expect("axes");
    let recording = with_force(|f| wrong.turn(Vec3::new(f.x, f.z, -f.y)));
    let [finding] = check(&recording)[..] else {
        panic!("one finding");
    };
    assert_eq!(
        finding.with_mounting(&wrong).to_string(),
        "x is up at rest, where the foot has z: --axes -x,z,y"
    );
    let right = parse_axes("-x,z,y").expect("axes");
    let recording = with_force(|f| right.turn(Vec3::new(f.x, f.z, -f.y)));
    assert_eq!(found(&recording), [""; 0]);
}

#[test]
fn gravity_at_rest_is_returned_if_present() {
    let up = gravity_at_rest(&walk()).expect("gravity");
    assert!((up - Vec3::new(0.0, 0.0, 9.81)).length() < 0.1, "{up:?}");
    let removed = Recording { gravity: Gravity::Removed, ..walk() };
    assert_eq!(gravity_at_rest(&removed), None);
    assert_eq!(gravity_at_rest(&with_force(scaled(0.1))), None);
}

#[test]
fn rates_in_degrees_are_found() {
    let mut recording = walk();
    for sample in &mut recording.samples {
        let rate = &mut sample.imu.angular_rate.0;
        *rate = Vec3::new(rate.x.to_degrees(), rate.y.to_degrees(), rate.z.to_degrees());
    }
    assert_eq!(found(&recording), ["rate_in_degrees"]);
}

#[test]
fn gyroscope_that_stops_is_dead_unless_the_foot_rests() {
    let mut recording = walk();
    // From the middle of a swing on.
    for sample in &mut recording.samples[950..1200] {
        sample.imu.angular_rate.0 = Vec3::ZERO;
    }
    assert_eq!(found(&recording), ["dead_gyroscope"]);
    for sample in &mut recording.samples {
        sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
        sample.imu.angular_rate.0 = Vec3::ZERO;
    }
    assert!(!found(&recording).contains(&"dead_gyroscope"));
}

#[test]
fn accelerations_in_mg_or_counts_are_found() {
    // Half and twice are of another full scale.
    for factor in [0.5, 2.0, 1000.0 / 9.81, 2048.0 / 9.81, 16384.0 / 9.81, 16384.0] {
        let found = found(&with_force(scaled(factor)));
        assert_eq!(found, ["acceleration_in_other_unit"], "{factor}");
    }
    // As read with --units g.
    let counts = check(&with_force(scaled(16384.0)));
    assert_eq!(
        counts[0].to_string(),
        "the acceleration is 160800 m/s² at rest, 16397 times gravity, so it is in another unit or of \
         another full scale: --units m/s2, g or mg, or --scale with the value of a count"
    );
}

#[test]
fn non_numbers_are_found_from_one_percent_on() {
    let without = |one_in: usize, at: usize| {
        let mut recording = walk();
        for sample in recording.samples.iter_mut().skip(at).step_by(one_in) {
            sample.imu.angular_rate.0.y = f32::NAN;
        }
        check(&recording)
    };
    assert_eq!(without(150, 7), []);
    let half = Finding::NotNumbers { samples: 1000, of: 2000 };
    assert_eq!(without(2, 0), [half]);
}

#[test]
fn clock_jump_is_found_but_short_gap_is_not() {
    let gap = |length_us: u64| with_times(move |k| 5_000 * k + if k < 900 { 0 } else { length_us });
    assert_eq!(found(&gap(5_000_000)), ["clock_jumps"]);
    assert_eq!(found(&gap(500_000)), [""; 0]);
    assert_eq!(
        check(&gap(5_000_000))[0].to_string(),
        "the clock jumps once, by up to 5.0 s: samples are missing, or --times rate"
    );
}

#[test]
fn batches_are_found_but_jitter_is_not() {
    let batches = with_times(|k| k / 10 * 50_000 + k % 10);
    assert_eq!(found(&batches), ["batches"]);
    let jitter = with_times(|k| 5_000 * k + (k * 7919) % 3_000);
    assert_eq!(found(&jitter), [""; 0]);
}

#[test]
fn rate_below_the_slowest_recordings_is_found() {
    let slower = |rate: f32| Recording { sample_rate: rate, ..walk() };
    assert_eq!(found(&slower(50.0)), ["low_rate"]);
    assert_eq!(found(&slower(99.5)), [""; 0]);
}

#[test]
fn recording_without_valid_samples_has_no_other_finding() {
    let mut recording = with_force(|_| Vec3::new(f32::NAN, 0.0, 0.0));
    assert_eq!(found(&recording), ["not_numbers"]);
    recording.samples.clear();
    assert_eq!(found(&recording), [""; 0]);
}
