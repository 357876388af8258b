//! Faults detected by the foot: raised with an emergency and a line of text, and cleared.

use core::ops::RangeInclusive;

use estimator_core::Validity;
use lsm6dsox::scale::{DEGREE, STANDARD_GRAVITY};
use wire::node::Crash;
use wire::{Counter, Fault};

use super::Foot;
use super::output::Level;
use crate::outlet::Lane;
use crate::ports::{BusState, Ports};
use crate::sampling::{Measurement, ReadAt, SATURATED_TICKS, SensorFault};
use crate::supervision::{FaultLatch, Hysteresis};

/// Consecutive good samples after which a fault of the sensor is cleared.
pub const SOUND_TICKS: u16 = 20;

/// Ticks for which a fault that is an event stays active after the event.
const EVENT_TICKS: u16 = 1000;

/// Ticks for which the crash that caused the start stays active as a fault. Object 0x2113 keeps it
/// until the next start.
const CRASH_TICKS: u16 = 10_000;

/// Specific force at rest of a sound accelerometer, m/s². An LSM6DSO32 has the same identity as an LSM6DSOX, and
/// half of its codes. Beyond these limits the estimator leaves so much of gravity that the foot never rests.
const FORCE_AT_REST: RangeInclusive<f32> = 0.88 * STANDARD_GRAVITY..=1.12 * STANDARD_GRAVITY;

/// State of the checks of the tick.
#[derive(Debug)]
pub(super) struct FaultState {
    /// Good samples since the last bad one.
    sound_ticks: u16,
    saturated: Hysteresis,
    latch: FaultLatch,
    bus: BusState,
    /// Received CAN frames lost since the start.
    can_lost: u32,
    /// Misreads on the sensor's bus that were reported.
    misreads: u32,
}

impl Default for FaultState {
    fn default() -> Self {
        Self {
            sound_ticks: 0,
            saturated: Hysteresis::new(1, SOUND_TICKS),
            latch: FaultLatch::default(),
            bus: BusState::Active,
            can_lost: 0,
            misreads: 0,
        }
    }
}

impl Foot {
    /// Raises faults of the sensor at once, and clears them after good samples.
    pub(super) fn check_sensor(&mut self, measurement: &Measurement, ports: &Ports) {
        if let Some(raw) = &measurement.raw {
            self.temperature = raw.temperature.to_celsius();
            match measurement.read_at {
                ReadAt::Timer => self.raise(Fault::DataReadyDead, 0, ports),
                ReadAt::Edge => self.clear(Fault::DataReadyDead, ports),
            }
        }
        let good = matches!(measurement.sample.validity, Validity::Valid | Validity::Saturated(_));
        self.fault_state.sound_ticks = match measurement.fault {
            None if good => self.fault_state.sound_ticks.saturating_add(1),
            _ => 0,
        };
        if let Some(SensorFault { fault, detail }) = measurement.fault {
            self.raise(fault, detail, ports);
        }
        if measurement.misreads != self.fault_state.misreads {
            self.fault_state.misreads = measurement.misreads;
            self.raise_event(Fault::Misread, measurement.misreads, ports);
        }
        if self.fault_state.saturated.update(measurement.saturated_for_long) {
            let samples = u32::from(SATURATED_TICKS);
            self.raise(Fault::SensorSaturated, samples, ports);
        } else {
            self.clear(Fault::SensorSaturated, ports);
        }
        if self.fault_state.sound_ticks >= SOUND_TICKS {
            // A failed self-test stays a fault until the next start.
            for fault in [
                Fault::SensorSilent,
                Fault::SensorFrozen,
                Fault::SensorWrongId,
                Fault::SensorReset,
                Fault::SensorConfigMismatch,
                Fault::SensorTiming,
            ] {
                self.clear(fault, ports);
            }
        }
    }

    /// Raises a fault while the gyroscope's bias is too large to be learnt, and from a rest with a wrong
    /// specific force to one with the right one.
    pub(super) fn check_rest(&mut self, ports: &Ports) {
        match self.estimator.excess_bias() {
            Some(rate) => {
                let milli_degrees = rate.0.length() * (1000.0 / DEGREE);
                self.raise(Fault::GyroBias, milli_degrees as u32, ports);
            }
            None => self.clear(Fault::GyroBias, ports),
        }
        if let Some(force) = self.estimator.force_at_rest() {
            if FORCE_AT_REST.contains(&force) {
                self.clear(Fault::SensorScale, ports);
            } else if !self.faults().void_estimate() {
                self.raise(Fault::SensorScale, (force * (1000.0 / STANDARD_GRAVITY)) as u32, ports);
            }
        }
    }

    pub(super) fn take_bus_state(&mut self, state: BusState, ports: &Ports) {
        let before = core::mem::replace(&mut self.fault_state.bus, state);
        if state == BusState::Off && before != BusState::Off {
            self.counters.add(Counter::CanBusOff, 1);
            self.report_bus_off(ports);
        }
        if before == BusState::Off && state != BusState::Off {
            self.node.release(Fault::CanBusOff);
            self.fault_state.latch.hold_for(Fault::CanBusOff, EVENT_TICKS);
        }
        match state {
            // Kept for a while: a bus that flickers would send an emergency each time.
            BusState::Active if before != BusState::Active => {
                self.fault_state.latch.hold_for(Fault::CanErrorPassive, EVENT_TICKS);
            }
            BusState::Active => {}
            BusState::Passive(receive, transmit) => {
                self.fault_state.latch.keep(Fault::CanErrorPassive);
                let detail = u32::from_le_bytes([receive, transmit, 0, 0]);
                self.raise(Fault::CanErrorPassive, detail, ports);
            }
            BusState::Off => {}
        }
    }

    /// Reports over the serial line at once; the emergency is held back until the bus has recovered.
    fn report_bus_off(&mut self, ports: &Ports) {
        self.fault_state.latch.keep(Fault::CanBusOff);
        let is_new = !self.faults().contains(Fault::CanBusOff);
        let times = self.counters.get(Counter::CanBusOff);
        self.node.raise_held_back(Fault::CanBusOff, times);
        if is_new {
            self.log(Level::Error, Fault::CanBusOff.name(), ports);
        }
    }

    pub(super) fn raise(&mut self, fault: Fault, detail: u32, ports: &Ports) {
        if self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.raise(fault, detail) {
            self.push_can(Lane::Notice, frame, ports);
        }
        self.log(Level::Error, fault.name(), ports);
    }

    pub(super) fn raise_event(&mut self, fault: Fault, detail: u32, ports: &Ports) {
        self.raise(fault, detail, ports);
        self.fault_state.latch.hold_for(fault, EVENT_TICKS);
    }

    pub(super) fn clear(&mut self, fault: Fault, ports: &Ports) {
        if !self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.clear(fault) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    pub(super) fn raise_crash(&mut self, crash: Crash, ports: &Ports) {
        self.raise(crash.fault, crash.program_counter, ports);
        self.fault_state.latch.hold_for(crash.fault, CRASH_TICKS);
    }

    pub(super) fn count_lost_can(&mut self, count: u32, ports: &Ports) {
        let lost = self.fault_state.can_lost.wrapping_add(count);
        self.fault_state.can_lost = lost;
        self.raise_event(Fault::CanOverrun, lost, ports);
    }

    /// Clears faults whose hold time after the event is over.
    pub(super) fn clear_expired_faults(&mut self, ports: &Ports) {
        for fault in self.fault_state.latch.tick().iter() {
            self.clear(fault, ports);
        }
    }
}
