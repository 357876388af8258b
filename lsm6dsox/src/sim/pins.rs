//! The interrupt pins: their levels and next rising edges.

use super::channel::Channel;
use super::part::Part;
use super::random::hash;
use crate::register::{self, counter_bdr_reg1, ctrl3_c, ctrl4_c, int1_ctrl, int2_ctrl};
use crate::setting::Pin;

/// Duration of a data-ready pulse, ns \[D\].
const PULSE_NS: u64 = 75_000;

impl Part {
    /// Returns whether accelerometer and gyroscope are routed to a pin.
    fn routing(&self, pin: Pin) -> (bool, bool) {
        let (int1, int2) =
            (self.memory.get(register::INT1_CTRL), self.memory.get(register::INT2_CTRL));
        let first = (int1_ctrl::DRDY_XL.is_set(int1), int1_ctrl::DRDY_G.is_set(int1));
        let second = (int2_ctrl::DRDY_XL.is_set(int2), int2_ctrl::DRDY_G.is_set(int2));
        let together = ctrl4_c::INT2_ON_INT1.is_set(self.memory.get(register::CTRL4_C));
        match (pin, together) {
            (Pin::Int1, false) => first,
            (Pin::Int2, false) => second,
            (Pin::Int1, true) => (first.0 || second.0, first.1 || second.1),
            (Pin::Int2, true) => (false, false),
        }
    }

    fn pulsed(&self) -> bool {
        counter_bdr_reg1::DATAREADY_PULSED.is_set(self.memory.get(register::COUNTER_BDR_REG1))
    }

    /// Returns whether a pin is high now.
    #[must_use]
    pub fn pin_is_high(&self, pin: Pin) -> bool {
        if self.faults.pins_lost {
            return false;
        }
        if let Some(period) = self.faults.storm_period_ns {
            return self.now_ns % period < period / 2;
        }
        self.glitches() || self.announces(pin) != self.is_active_low()
    }

    /// Width of a glitch, if that is what drives a pin high now, ns.
    #[must_use]
    pub fn glitch_ns(&self, pin: Pin) -> Option<u64> {
        let is_glitch = self.glitches() && self.announces(pin) == self.is_active_low();
        let [_, width] = self.faults.glitches_ns?;
        is_glitch.then_some(width)
    }

    /// Returns whether the part drives INT1 high now.
    pub(super) fn drives_int1(&self) -> bool {
        self.announces(Pin::Int1) != (self.is_active_low() != self.faults.pins_inverted)
    }

    /// Returns whether the pins are active low at the host.
    fn is_active_low(&self) -> bool {
        let active_low = ctrl3_c::H_LACTIVE.is_set(self.memory.get(register::CTRL3_C));
        active_low != self.faults.pins_inverted
    }

    /// Returns whether the pulse that begins at `edge_ns` is lost.
    const fn loses(&self, edge_ns: u64) -> bool {
        hash(edge_ns) % 1_000_000 < self.faults.losses_per_million as u64
    }

    /// Returns whether a glitch drives the pins high now.
    fn glitches(&self) -> bool {
        let glitches = self.faults.glitches_ns;
        glitches.is_some_and(|[period, width]| self.now_ns % period < width)
    }

    /// Returns whether a signal routed to a pin drives it high.
    fn announces(&self, pin: Pin) -> bool {
        let (accel, gyro) = self.routing(pin);
        let recent = |edge: Option<u64>| {
            edge.is_some_and(|edge| self.now_ns < edge + PULSE_NS && !self.loses(edge))
        };
        let (accel_ready, gyro_ready) = if self.pulsed() {
            (recent(self.accel_edge_ns), recent(self.gyro_edge_ns))
        } else {
            (self.words.accel_fresh, self.words.gyro_fresh)
        };
        (accel && accel_ready) || (gyro && gyro_ready)
    }

    /// Time of a pin's next rising edge by data-ready, ns since power-up, later than now: `None` without an
    /// edge, or if there is none before the sample that holds the pin high is read.
    #[must_use]
    pub fn next_rising_edge_ns(&self, pin: Pin) -> Option<u64> {
        if self.faults.pins_lost {
            return None;
        }
        if let Some(period) = self.faults.storm_period_ns {
            return Some((self.now_ns / period + 1) * period);
        }
        let (accel, gyro) = self.routing(pin);
        if self.is_active_low() {
            return self.next_end_of_a_pulse_ns(accel, gyro);
        }
        if !self.pulsed() && self.announces(pin) {
            return None;
        }
        // A glitch within a sample's pulse does not cause an edge.
        let pulse_end = |routed: bool, edge: Option<u64>| {
            let edge = edge.filter(|_| routed && self.pulsed());
            edge.map_or(0, |edge| edge + PULSE_NS - 1)
        };
        let low_from = self
            .now_ns
            .max(pulse_end(accel, self.accel_edge_ns).max(pulse_end(gyro, self.gyro_edge_ns)));
        let glitch = self.faults.glitches_ns;
        let glitch = glitch.map(|[period, _]| (low_from / period + 1) * period);
        let edge = |routed: bool, channel: &Channel| {
            routed.then(|| self.next_sample_ns(channel)).flatten()
        };
        [edge(accel, &self.accel), edge(gyro, &self.gyro), glitch].into_iter().flatten().min()
    }

    /// Time of the next rising edge of active-low pins: the end of a pulse; latched pins rise when a sample
    /// is read.
    fn next_end_of_a_pulse_ns(&self, accel: bool, gyro: bool) -> Option<u64> {
        if !self.pulsed() {
            return None;
        }
        let end = |routed: bool, last: Option<u64>, channel: &Channel| {
            let last = last.filter(|edge| self.now_ns < edge + PULSE_NS);
            let edge = last.or_else(|| self.next_sample_ns(channel));
            edge.filter(|_| routed).map(|edge| edge + PULSE_NS)
        };
        [end(accel, self.accel_edge_ns, &self.accel), end(gyro, self.gyro_edge_ns, &self.gyro)]
            .into_iter()
            .flatten()
            .min()
    }

    fn next_sample_ns(&self, channel: &Channel) -> Option<u64> {
        let starts_ps = channel.starts_ns * 1000;
        let mut tick = self.next_tick;
        if starts_ps > self.clock.tick_ps(tick) {
            tick = self.clock.next_tick(starts_ps.saturating_sub(1));
        }
        loop {
            tick = channel.next_sample(tick)?;
            let edge_ns = self.clock.tick_ps(tick).div_ceil(1000);
            if !self.loses(edge_ns) {
                return Some(edge_ns);
            }
            tick += 1;
        }
    }
}
