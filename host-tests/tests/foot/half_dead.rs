//! A partly failed sensor: detected within its bound, and never trusted while the fault lasts.

use crate::bench::{Bench, MS, ORDINARY, Run, SECOND, part, run};
use estimator_core::Decision;
use firmware::sampling::READ_BACK_TICKS;
use lsm6dsox::sim::{Axis, Part, PartFault, SharedPart, Stimulus};
use lsm6dsox::{Sensor, SpiClock, register};
use wire::{Fault, Settings};

/// Time of the fault, ns: the foot stands and says "stable" by then.
const BEGIN: u64 = 1500 * MS;

/// Observations of one fault.
#[derive(Default)]
struct Seen {
    /// Time from the fault to the last frame that said "stable" while it lasted, ns.
    last_stable: u64,
    /// Time from the fault to its report, ns.
    reported_after: Option<u64>,
    /// First report: the fault and its detail.
    reported: Option<(Fault, u32)>,
    /// All reported faults, also after the end of the fault.
    all: Vec<Fault>,
    /// Whether a report was withdrawn while the fault lasted.
    withdrawn: bool,
    /// Whether the foot said "stable" at the end, two seconds after the end of the fault.
    stable_at_the_end: bool,
}

/// Observes a foot that stands, and from [`BEGIN`] on moves by `moves` with `fault`, for a second and a half.
fn watch(fault: PartFault, moves: Stimulus, phase_ns: u64) -> Seen {
    let begin = BEGIN + phase_ns;
    let end = begin + 1500 * MS;
    let seconds = |ns: u64| ns as f64 / SECOND as f64;
    let moving = seconds(begin)..seconds(end);
    let motion = move |t: f64| {
        if moving.contains(&t) {
            moves
        } else {
            Stimulus::REST
        }
    };
    let part = part(motion, ORDINARY);
    let inject = |part: &SharedPart| part.inject(fault);
    let clear = |part: &SharedPart| part.with(Part::clear_faults);
    let options = Run {
        actions: &[(begin, &inject), (end, &clear)],
        ..Run::default()
    };
    let mut bench = Bench::new(Settings::default());
    let mut seen = Seen::default();
    run(
        options,
        &part,
        &mut bench,
        end + 3 * SECOND,
        |bench, _, _| {
            let now = part.now_ns();
            let stable = bench
                .contact()
                .expect("a frame each tick")
                .status
                .decision()
                == Decision::Stable;
            seen.stable_at_the_end = stable;
            let raised = bench
                .emergencies()
                .into_iter()
                .filter(|emergency| emergency.code != 0);
            seen.all
                .extend(raised.filter_map(|emergency| emergency.fault));
            if !(begin..end).contains(&now) {
                return;
            }
            if stable {
                seen.last_stable = now - begin;
            }
            for emergency in bench.emergencies() {
                seen.withdrawn |= emergency.code == 0;
                if let Some(fault) = emergency.fault {
                    seen.reported_after.get_or_insert(now - begin);
                    seen.reported.get_or_insert((fault, emergency.detail));
                }
            }
        },
    );
    seen
}

fn slide() -> Stimulus {
    let [x, y, z] = Stimulus::REST.specific_force;
    Stimulus {
        specific_force: [x + 3.0, y, z],
        ..Stimulus::REST
    }
}

fn turn() -> Stimulus {
    Stimulus {
        angular_rate: [2.0, 0.0, 0.0],
        ..Stimulus::REST
    }
}

#[test]
fn a_half_dead_sensor_is_reported_and_never_trusted() {
    let stuck = |sensor, axis, code| PartFault::AxisStuck { sensor, axis, code };
    for (name, fault, moves, axes, within) in [
        ("ax", stuck(Sensor::Accel, Axis::X, 0), slide(), 0b1, 31),
        (
            "az",
            stuck(Sensor::Accel, Axis::Z, 2049),
            slide(),
            0b100,
            31,
        ),
        ("wx", stuck(Sensor::Gyro, Axis::X, 0), turn(), 0b1000, 91),
        // 0.2 rad/s.
        (
            "wy at 0.2 rad/s",
            stuck(Sensor::Gyro, Axis::Y, 164),
            Stimulus::REST,
            0b1_0000,
            91,
        ),
        (
            "accelerometer",
            PartFault::SensorFrozen(Sensor::Accel),
            slide(),
            0b111,
            21,
        ),
        (
            "gyroscope",
            PartFault::SensorFrozen(Sensor::Gyro),
            turn(),
            0b11_1000,
            41,
        ),
        ("all", PartFault::FrozenOutput, slide(), 0b11_1111, 5),
    ] {
        for phase in 0..4 {
            let seen = watch(fault, moves, phase * 2_713_313);
            let name = format!("{name}, phase {phase}");
            assert_eq!(seen.reported, Some((Fault::SensorFrozen, axes)), "{name}");
            let after = seen.reported_after.unwrap_or(u64::MAX);
            assert!(after <= (within + 1) * MS, "{name}: {after} ns");
            assert!(
                seen.last_stable <= within * MS,
                "{name}: {} ns",
                seen.last_stable
            );
            assert!(!seen.withdrawn, "{name}");
            assert!(seen.stable_at_the_end, "{name}");
        }
    }
}

#[test]
fn a_foot_at_rest_for_ten_minutes_has_no_frozen_axis() {
    let part = part(|_: f64| Stimulus::REST, ORDINARY);
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    run(
        Run::default(),
        &part,
        &mut bench,
        600 * SECOND,
        |bench, _, _| {
            reported.extend(bench.emergencies());
        },
    );
    assert_eq!(reported, []);
}

#[test]
fn a_stuck_data_line_is_not_mistaken_for_a_sensor_reset() {
    for fault in [PartFault::MisoStuckLow, PartFault::MisoStuckHigh] {
        let seen = watch(fault, Stimulus::REST, 0);
        assert_eq!(seen.all, [Fault::SensorWrongId], "{fault:?}");
        assert!(seen.stable_at_the_end, "{fault:?}");
    }
}

#[test]
fn a_sensor_with_a_slow_data_line_is_read_at_half_the_clock() {
    let part = part(|_: f64| Stimulus::REST, ORDINARY);
    part.inject(PartFault::SdoDelay { ns: 100 });
    part.with(|part| part.set_bus_clock(SpiClock::Full.hertz()));
    let mut bench = Bench::new(Settings::default());
    let mut stable = false;
    run(
        Run::default(),
        &part,
        &mut bench,
        3 * SECOND,
        |bench, _, _| {
            let contact = bench.contact().expect("a frame each tick");
            stable = contact.status.decision() == Decision::Stable;
        },
    );
    assert!(stable);
    // More than half a period of 5 MHz, and less than half a period of 2.5 MHz.
    let least_ns = part.with(|part| part.least_half_period_ns());
    assert!(least_ns > 100 && least_ns < 200);
}

#[test]
fn an_unexpected_register_change_is_reported_and_corrected() {
    for (register, bits) in [
        (register::CTRL5_C, 0b01),
        (register::CTRL5_C, 0b0100),
        (register::CTRL7_G, 0x40),
        (register::FUNC_CFG_ACCESS, 0x80),
        (register::FUNC_CFG_ACCESS, 0x40),
        (register::CTRL3_C, 0x08),
        (register::PIN_CTRL, 0x40),
        (register::X_OFS_USR, 0x10),
        (register::Y_OFS_USR, 0x01),
        (register::Z_OFS_USR, 0x80),
    ] {
        let fault = PartFault::RegisterFlipped {
            address: register.address,
            bits,
        };
        for phase in 0..4 {
            let seen = watch(fault, Stimulus::REST, phase * 1_083_313);
            let name = format!("{} ^ {bits:#04x}, phase {phase}", register.name);
            assert!(
                matches!(
                    seen.reported,
                    Some((Fault::SensorConfigMismatch | Fault::SensorWrongId, _))
                ),
                "{name}: {:?}",
                seen.reported
            );
            let after = seen.reported_after.unwrap_or(u64::MAX);
            assert!(
                after <= (READ_BACK_TICKS as u64 + 2) * MS,
                "{name}: {after} ns"
            );
            assert!(seen.stable_at_the_end, "{name}");
        }
    }
}

#[test]
fn the_register_with_a_data_rate_is_read_back_every_third_tick() {
    let fault = PartFault::RegisterFlipped {
        address: register::CTRL1_XL.address,
        // The filter behind the rate: samples stay fresh.
        bits: 0x02,
    };
    for phase in 0..6 {
        let seen = watch(fault, Stimulus::REST, phase * 583_313);
        let reported = seen.reported.map(|(fault, _)| fault);
        assert_eq!(reported, Some(Fault::SensorConfigMismatch), "phase {phase}");
        let after = seen.reported_after.unwrap_or(u64::MAX);
        assert!(after <= 4 * MS, "phase {phase}: {after} ns");
        assert!(seen.stable_at_the_end, "phase {phase}");
    }
}
