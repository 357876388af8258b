//! Frames and lines of text on their way to the queues of [`Ports`].

use estimator_core::{ContactEstimate, Timestamp};
use lsm6dsox::scale::FullScale;
use wire::node::State;
use wire::pdo::{Pdo, Quantity, TEMPERATURE_STEP};
use wire::uart::{self, ContactMessage, HealthMessage, LogMessage, Message};
use wire::{CanFrame, Counter};

use super::Foot;
use crate::outlet::Lane;
use crate::ports::Ports;
use crate::sampling::Measurement;

/// Severity of a line of text; the log level of the settings is compared with these numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    Error = 1,
    Warning = 2,
    Information = 3,
}

/// State of the CAN and UART outputs.
#[derive(Debug)]
pub(super) struct Output {
    /// Without a crystal there is no CAN.
    pub(super) with_can: bool,
    /// Sequence number of the next UART frame.
    sequence: u16,
}

impl Output {
    pub(super) const fn new(with_can: bool) -> Self {
        Self { with_can, sequence: 0 }
    }
}

impl Foot {
    pub(super) fn send_can(&mut self, estimate: &ContactEstimate, ports: &Ports) {
        let with_can = self.output.with_can;
        let mut dropped = 0;
        let (node, counters) = (&mut self.node, &self.counters);
        node.tick(estimate, self.temperature, counters, |frame| {
            if with_can {
                dropped += ports.push_can(lane_of(&frame), frame);
            }
        });
        self.counters.add(Counter::CanDropped, dropped);
    }

    pub(super) fn send_uart(
        &mut self,
        estimate: &ContactEstimate,
        measurement: &Measurement,
        now: Timestamp,
        ports: &Ports,
    ) {
        if self.node.state() == State::Stopped {
            return;
        }
        let streams = self.settings().uart_streams();
        let ticks = self.ticks;
        let tick_us = self.tick_us.max(1);
        // The number of ticks that is nearest.
        let is_due = |every_ms: u16| {
            let every = (u32::from(every_ms) * 1_000 + tick_us / 2) / tick_us;
            every_ms != 0 && ticks.is_multiple_of(every.max(1))
        };
        if is_due(streams.contact) {
            let contact = ContactMessage::new(estimate, self.node.faults());
            self.push_uart(Lane::Estimate, &Message::Contact(contact), ports);
        }
        if is_due(streams.raw)
            && let Some(raw) = raw_message(measurement, self.settings().accelerometer_range())
        {
            self.push_uart(Lane::Stream, &Message::Raw(raw), ports);
        }
        if is_due(streams.health) {
            let health = HealthMessage {
                timestamp: now,
                stage: self.stage,
                state: self.node.state(),
                id: self.node.id(),
                faults: self.node.faults(),
                temperature: Quantity::new(self.temperature, TEMPERATURE_STEP),
                counters: self.counters,
                unknown_faults: 0,
            };
            self.push_uart(Lane::Stream, &Message::Health(health), ports);
        }
    }

    pub(super) fn log(&mut self, level: Level, text: &str, ports: &Ports) {
        self.log_line(level, LogMessage::new(level as u8, text), ports);
    }

    /// Sends a line if the settings allow its level.
    pub(super) fn log_line(&mut self, level: Level, line: LogMessage, ports: &Ports) {
        if level as u8 <= self.settings().log_level() {
            // Errors go before responses, of which there can be many.
            let lane = match level {
                Level::Error => Lane::Notice,
                Level::Warning | Level::Information => Lane::Answer,
            };
            self.push_uart(lane, &Message::Log(line), ports);
        }
    }

    pub(super) fn push_can(&mut self, lane: Lane, frame: CanFrame, ports: &Ports) {
        if self.output.with_can {
            let dropped = ports.push_can(lane, frame);
            self.counters.add(Counter::CanDropped, dropped);
        }
    }

    pub(super) fn push_uart(&mut self, lane: Lane, message: &Message, ports: &Ports) {
        let sequence = self.output.sequence;
        self.output.sequence = sequence.wrapping_add(1);
        let dropped = ports.push_uart(lane, sequence, message);
        self.counters.add(Counter::UartDropped, dropped);
    }
}

/// Process data are a stream, the contact before all others; emergencies (0x080) and heartbeats
/// (0x700) are not.
const fn lane_of(frame: &CanFrame) -> Lane {
    const CONTACT: u16 = Pdo::Contact.base();
    match frame.id() & 0x780 {
        CONTACT => Lane::Estimate,
        0x080 | 0x700 => Lane::Notice,
        _ => Lane::Stream,
    }
}

/// Message with the codes of a sample; `range` is [`Settings::accelerometer_range`](wire::Settings::accelerometer_range).
fn raw_message(measurement: &Measurement, range: f32) -> Option<uart::RawMessage> {
    let raw = measurement.raw?;
    Some(uart::RawMessage {
        timestamp: measurement.sample.timestamp,
        validity: measurement.sample.validity,
        temperature: Quantity::new(raw.temperature.to_celsius(), TEMPERATURE_STEP),
        acceleration: raw.specific_force.codes,
        rate: raw.angular_rate.codes,
        acceleration_scale: raw.specific_force.full_scale.sensitivity() * range,
        rate_scale: raw.angular_rate.full_scale.sensitivity(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_frame_has_its_lane() {
        for (id, lane) in [
            (0x191, Lane::Estimate),
            (0x091, Lane::Notice),
            (0x711, Lane::Notice),
            (0x291, Lane::Stream),
            (0x391, Lane::Stream),
            (0x511, Lane::Stream),
        ] {
            let frame = CanFrame::new(id, &[]).expect("a frame");
            assert_eq!(lane_of(&frame), lane, "{id:#x}");
        }
    }
}
