//! Recorded walk of one foot: the board's own program, fed with the samples of a simulation, and its output.
//!
//! Each millisecond has the inputs of a board: the load sent over CAN by the robot's control and the sample of its
//! data-ready edge.

use estimator_core::{ContactEstimate, ParamsError, Timestamp};
use feet::decode::can_log::Logged;
use feet::link::clock::since_2021;
use firmware::exchange::Input;
use firmware::sampling::Measurement;
use gait::Simulation;
use gait::control::load_frame;
use gait::record::TICK_US;
use wire::Settings;

use crate::board::{self, SimulatedBus, SimulatedProgram, settings, switched_on};

/// Serial number of the foot.
const SERIAL: u32 = 1;

/// Estimates and output of a foot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transmission {
    /// Estimates, one per sample.
    pub estimates: Vec<ContactEstimate>,
    /// CAN frames in order of time.
    pub can: Vec<Logged>,
    /// Bytes of the serial line.
    pub uart: Vec<u8>,
}

impl Transmission {
    /// Returns the CAN frames as a log of `candump -l`.
    #[must_use]
    pub fn can_log(&self) -> String {
        let line = |logged: &Logged| format!("{}\n", logged.line(board::INTERFACE));
        self.can.iter().map(line).collect()
    }
}

/// Simulates a foot with the default [settings]: one tick per sample.
///
/// # Errors
/// The errors of [`walk_with`].
pub fn walk(simulation: &Simulation) -> Result<Transmission, ParamsError> {
    walk_with(&settings(), simulation, |_, _| ())
}

/// Simulates a foot with the given settings. Before each tick, calls `change` with the tick's index (from 0) and
/// its measurement.
///
/// # Errors
/// The parameters of the settings are inconsistent.
///
/// # Panics
/// Never: each tick processes the load that was queued before it.
pub fn walk_with(
    settings: &Settings,
    simulation: &Simulation,
    mut change: impl FnMut(usize, &mut Measurement),
) -> Result<Transmission, ParamsError> {
    let mut program = SimulatedProgram::new(settings.clone(), switched_on(SERIAL))?;
    let mut sent = Transmission::default();
    let mut bus = SimulatedBus::default();
    let samples = simulation.recording.samples.iter().zip(&simulation.raw);
    for (index, (sample, raw)) in samples.enumerate() {
        let mut measurement = board::measurement(sample.imu, *raw);
        change(index, &mut measurement);
        let edge = measurement.sample.timestamp;
        let time = Timestamp::from_micros(index as u64 * TICK_US);
        if let (Some(load), Some(id)) = (sample.load, settings.node_id())
            && let Some(frame) = load_frame(id, load.0)
        {
            let taken = program.ports.try_put(Input::Can(frame, time));
            assert!(taken, "each tick empties the inputs");
        }
        program.tick(time, &measurement);
        sent.estimates.push(*program.foot.estimate());
        for frame in program.frames() {
            let at = since_2021(bus.carry(edge));
            sent.can.push(Logged { at, frame });
        }
        sent.uart.append(&mut program.take_serial());
    }
    Ok(sent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use config::default_params;
    use estimator_core::{Saturation, Validity};
    use feet::decode::report::BoardReport;
    use feet::decode::{KnownFeet, decode};
    use gait::{GaitName, Ground, Plan, SensorParams, simulate};
    use samples::estimate::estimates_of;
    use wire::{Counter, Pdo};

    /// A foot that stands for one second.
    fn standing() -> Simulation {
        let plan = Plan::steady(GaitName::Stand, Ground::Hard, 1.0, 1);
        simulate(&plan, &SensorParams::LSM6DSOX, 1)
    }

    fn sent(change: impl FnMut(usize, &mut Measurement)) -> Transmission {
        walk_with(&settings(), &standing(), change).expect("valid settings")
    }

    #[test]
    fn default_messages_follow_the_boot_up() {
        let transmission = sent(|_, _| ());
        let frames: Vec<_> = transmission.can.iter().map(|logged| logged.frame).collect();
        assert_eq!((frames[0].id(), frames[0].data()), (0x711, &[0][..]));
        for pdo in Pdo::ALL {
            let expected = 1000 / usize::from(pdo.default_period_ms());
            let count = frames
                .iter()
                .filter(|frame| Pdo::from_cob_id(frame.id()).is_some_and(|(sent, _)| sent == pdo));
            assert_eq!(count.count(), expected, "{}", pdo.name());
        }
        let heartbeats = frames.iter().filter(|frame| frame.id() == 0x711).count() - 1;
        assert_eq!(heartbeats, 2);
        assert!(transmission.can.windows(2).all(|pair| pair[0].at < pair[1].at));
        let log = transmission.can_log();
        let first = log.lines().next();
        assert!(
            first.is_some_and(
                |line| line.starts_with("(1609459200.000") && line.ends_with(" can0 711#00")
            ),
            "{first:?}"
        );
    }

    #[test]
    fn estimates_match_a_replay_of_the_samples() {
        let walk = simulate(&Plan::demo(1), &SensorParams::LSM6DSOX, 1);
        let replayed = estimates_of(&walk.recording, &default_params()).expect("the preset");
        assert!(super::walk(&walk).expect("valid settings").estimates == replayed);
    }

    /// Last health message of one second on the serial line.
    fn health_after(change: impl FnMut(usize, &mut Measurement)) -> BoardReport {
        let decoded =
            decode(&sent(change).uart, "uart.bin", &KnownFeet::default()).expect("a recording");
        decoded.report.board.expect("a health message")
    }

    #[test]
    fn samples_are_counted_by_validity() {
        let health = health_after(|index, measurement| {
            measurement.sample.validity = match index {
                500 => Validity::Stale,
                510 | 520 => Validity::Invalid,
                530 => Validity::Saturated(Saturation::Both),
                _ => Validity::Valid,
            };
        });
        let count = |counter: Counter| health.counters[counter.name()];
        let ticks = count(Counter::Ticks);
        assert_eq!(ticks, 1000);
        assert_eq!(count(Counter::MissedSamples), 3);
        assert_eq!(count(Counter::SaturatedSamples), 1);
        assert_eq!(count(Counter::ValidSamples), ticks - 4);
    }

    #[test]
    fn health_has_stage_and_optional_temperature() {
        let health = health_after(|_, _| ());
        assert_eq!((health.stage, health.temperature), ("running", Some(25.0)));
        let health = health_after(|_, measurement| {
            measurement.raw = None;
            measurement.sample.validity = Validity::Invalid;
        });
        assert_eq!((health.stage, health.temperature), ("hold_still", None));
    }
}
