//! What a foot says of its estimates, byte by byte as the foot's own program says it: on CAN the
//! frames of a [`wire::Node`], on the serial line the messages of [`wire::uart`].

use estimator_core::{ContactEstimate, Flag, Timestamp};
use wire::counter::{Counter, Counters};
use wire::pdo::{Quantity, TEMPERATURE_STEP};
use wire::uart::{self, ContactMessage, HealthMessage, Message};
use wire::{BootCause, CanFrame, Fault, Node, Settings, Stage};

use crate::can_log::Logged;

/// Time 0 of the foot's clock in logs, which want a date: the first of January 2021, µs.
pub const EPOCH_US: u64 = 1_609_459_200_000_000;

/// Name of the CAN interface in logs.
pub const INTERFACE: &str = "can0";

/// What a frame of 8 bytes takes on a bus of 1 Mbit/s, µs: 111 bits, stuff bits not counted.
const FRAME_US: u64 = 111;

/// A fault comes or goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultChange {
    /// When: with the first sample that is not earlier.
    pub at: Timestamp,
    /// Which.
    pub fault: Fault,
    /// It comes with this detail, or it goes.
    pub detail: Option<u32>,
}

/// Everything a foot has sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transmission {
    /// On CAN, in the order of time.
    pub can: Vec<Logged>,
    /// On the serial line.
    pub uart: Vec<u8>,
}

impl Transmission {
    /// The CAN frames as a log of `candump -l`.
    #[must_use]
    pub fn can_log(&self) -> String {
        self.can
            .iter()
            .map(|logged| format!("{}\n", logged.line(INTERFACE)))
            .collect()
    }
}

/// Sends estimates, one a tick, with the sensor's temperature of each in °C and with `faults` in
/// the order of their times. The settings decide what is sent when, and by which foot.
#[must_use]
pub fn transmit(
    settings: &Settings,
    estimates: &[ContactEstimate],
    temperatures: &[f32],
    faults: &[FaultChange],
) -> Transmission {
    let streams = settings.uart_streams();
    let mut node = Node::new(settings.clone(), 1);
    let mut counters = Counters::default();
    let mut bus = Bus::default();
    let mut line = Line::default();
    let mut faults = faults.iter().peekable();
    let start = Timestamp::default();
    bus.send_all(start, node.boot(BootCause::PowerUp));
    for (tick, (estimate, temperature)) in (1_u32..).zip(estimates.iter().zip(temperatures)) {
        let now = estimate.timestamp;
        while let Some(change) = faults.next_if(|change| change.at <= now) {
            bus.send_all(
                now,
                match change.detail {
                    Some(detail) => node.raise(change.fault, detail),
                    None => node.clear(change.fault),
                },
            );
        }
        count(&mut counters, estimate);
        node.tick(estimate, *temperature, &counters, |frame| {
            bus.send(now, frame);
        });
        let due = |period: u16| period != 0 && tick.is_multiple_of(u32::from(period));
        if due(streams.contact) {
            line.send(&Message::Contact(ContactMessage::new(
                estimate,
                node.faults(),
            )));
        }
        if due(streams.health) {
            line.send(&Message::Health(HealthMessage {
                timestamp: now,
                stage: stage(estimate),
                state: node.state(),
                id: node.id(),
                faults: node.faults(),
                unknown_faults: 0,
                temperature: Quantity::new(*temperature, TEMPERATURE_STEP),
                counters,
            }));
        }
    }
    Transmission {
        can: bus.log,
        uart: line.bytes,
    }
}

fn stage(estimate: &ContactEstimate) -> Stage {
    if estimate.flags.contains(Flag::AttitudeNotInitialised) {
        Stage::HoldStill
    } else {
        Stage::Running
    }
}

fn count(counters: &mut Counters, estimate: &ContactEstimate) {
    counters.add(Counter::Ticks, 1);
    if estimate.flags.contains(Flag::Saturated) {
        counters.add(Counter::SaturatedSamples, 1);
    } else if estimate.flags.contains(Flag::Stale) || estimate.flags.contains(Flag::InvalidSample) {
        counters.add(Counter::MissedSamples, 1);
    } else {
        counters.add(Counter::ValidSamples, 1);
    }
}

/// A bus that nobody else uses: one frame after the other, stamped when it is complete.
#[derive(Default)]
struct Bus {
    log: Vec<Logged>,
    free_us: u64,
}

impl Bus {
    fn send(&mut self, at: Timestamp, frame: CanFrame) {
        self.free_us = self.free_us.max(at.as_micros()) + FRAME_US;
        self.log.push(Logged {
            at: Timestamp::from_micros(EPOCH_US + self.free_us),
            frame,
        });
    }

    fn send_all(&mut self, at: Timestamp, frames: impl IntoIterator<Item = CanFrame>) {
        for frame in frames {
            self.send(at, frame);
        }
    }
}

#[derive(Default)]
struct Line {
    bytes: Vec<u8>,
    sequence: u16,
}

impl Line {
    fn send(&mut self, message: &Message) {
        let frame = uart::encode(self.sequence, message);
        self.bytes.extend_from_slice(frame.as_bytes());
        self.sequence = self.sequence.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::decode;
    use crate::decode::report::BoardReport;
    use estimator_core::Flags;
    use wire::{Emergency, Pdo};

    fn estimates(count: u64) -> Vec<ContactEstimate> {
        (0..count)
            .map(|k| ContactEstimate {
                timestamp: Timestamp::from_micros(k * 1000 + 77),
                ..ContactEstimate::default()
            })
            .collect()
    }

    fn sent(count: u64, faults: &[FaultChange]) -> Transmission {
        let estimates = estimates(count);
        let temperatures = vec![25.0; estimates.len()];
        transmit(&Settings::default(), &estimates, &temperatures, faults)
    }

    #[test]
    fn a_second_brings_what_the_dictionarys_defaults_say_after_the_boot_up() {
        let transmission = sent(1000, &[]);
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
        assert!(
            transmission
                .can
                .windows(2)
                .all(|pair| pair[0].at < pair[1].at)
        );
        let first = transmission.can_log();
        assert!(
            first.starts_with("(1609459200.000111) can0 711#00\n"),
            "{first:.60}"
        );
    }

    /// The last health message on the line after these estimates and one sound one.
    fn health_after(estimates: &[ContactEstimate], temperature: f32) -> BoardReport {
        let period = usize::from(Settings::default().uart_streams().health);
        let mut estimates = estimates.to_vec();
        estimates.resize(period, ContactEstimate::default());
        let temperatures = vec![temperature; period];
        let sent = transmit(&Settings::default(), &estimates, &temperatures, &[]);
        let decoded = decode(&sent.uart, "uart.bin", &[]).expect("a recording");
        decoded.report.board.expect("a health message")
    }

    #[test]
    fn what_is_counted_as_valid_is_neither_saturated_nor_stale_nor_invalid() {
        let flagged = |flags: &[Flag]| ContactEstimate {
            flags: flags
                .iter()
                .fold(Flags::NONE, |flags, flag| flags.with(*flag)),
            ..ContactEstimate::default()
        };
        let health = health_after(
            &[
                flagged(&[Flag::Stale]),
                flagged(&[Flag::InvalidSample]),
                flagged(&[Flag::InvalidSample, Flag::Stale]),
                flagged(&[Flag::Saturated]),
                flagged(&[Flag::WindowNotFull]),
                flagged(&[Flag::TimeGap]),
            ],
            25.0,
        );
        let count = |counter: Counter| health.counters[counter.name()];
        let ticks = count(Counter::Ticks);
        assert_eq!(
            u64::from(ticks),
            u64::from(Settings::default().uart_streams().health)
        );
        assert_eq!(count(Counter::MissedSamples), 3);
        assert_eq!(count(Counter::SaturatedSamples), 1);
        assert_eq!(count(Counter::ValidSamples), ticks - 4);
    }

    #[test]
    fn health_says_the_stage_and_a_temperature_only_where_there_is_one() {
        let health = health_after(&[], 31.25);
        assert_eq!((health.stage, health.temperature), ("running", Some(31.25)));
        let period = usize::from(Settings::default().uart_streams().health);
        let lost = ContactEstimate {
            flags: Flags::NONE.with(Flag::AttitudeNotInitialised),
            ..ContactEstimate::default()
        };
        let health = health_after(&vec![lost; period], f32::NAN);
        assert_eq!((health.stage, health.temperature), ("hold_still", None));
    }

    #[test]
    fn a_fault_is_told_when_it_comes_and_when_it_goes() {
        let change = |ms: u64, detail| FaultChange {
            at: Timestamp::from_micros(ms * 1000),
            fault: Fault::SensorSilent,
            detail,
        };
        let transmission = sent(100, &[change(10, Some(2500)), change(20, None)]);
        let told: Vec<_> = transmission
            .can
            .iter()
            .filter(|logged| logged.frame.id() == 0x91)
            .map(|logged| Emergency::decode(logged.frame.data8().expect("8 bytes")))
            .map(|emergency| (emergency.code, emergency.detail))
            .collect();
        assert_eq!(told, [(0x7001, 2500), (0, 0)]);
    }
}
