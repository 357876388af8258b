//! Record of everything the board sends, with times.

use estimator_core::Decision;
use wire::uart::{Answer, Decoder, HealthMessage, Message};
use wire::{Address, Emergency, Fault, Pdo, pdo};

use crate::emulator::board::Board;
use crate::emulator::failure::Failure;
use crate::emulator::part::can::TimedFrame;
use crate::emulator::part::usart::TimedByte;
use crate::emulator::time::{PER_SECOND, to_us};
use crate::product::parity;

/// An external line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Can,
    Uart,
}

impl Line {
    pub(super) const BOTH: [Self; 2] = [Self::Can, Self::Uart];
}

/// A contact frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactFrame {
    pub(super) line: Line,
    /// Time at which its last byte had left.
    pub(super) time: u64,
    /// Stable by decision, or by a probability above one half without a flag.
    pub(super) stable: bool,
    pub(super) valid: bool,
    /// Time from the sample, on the board's clock, to `time`, µs, up to a constant; for CAN modulo [`SHORT_US`].
    pub(super) age_us: f64,
    /// Time of the sample, if the frame has the whole time.
    pub(super) sample_us: Option<u64>,
}

/// Period of short times, µs.
pub(super) const SHORT_US: f64 = 655_360.0;

/// A report of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reported {
    /// Emergency message over CAN.
    Emergency(Fault),
    /// Emergency message over CAN that reports the fault cleared.
    Cleared(Fault),
    /// Report over the serial line, in the log or in the health message.
    Serial(Fault),
    /// The boot-up message.
    BootUp,
}

/// Record of everything that was sent.
#[derive(Default)]
pub(super) struct Watch {
    pub(super) contacts: Vec<ContactFrame>,
    pub(super) reported: Vec<(u64, Reported)>,
    pub(super) health: Vec<(u64, HealthMessage)>,
    /// Samples read from the sensor: time, and the preceding data-ready edge.
    pub(super) samples: Vec<(u64, Option<u64>)>,
    /// Answers to requests for settings.
    answers: Vec<(Address, Vec<u8>)>,
    decoder: Decoder,
    /// Time at which the last byte, except a frame's end, left.
    last_byte: u64,
}

impl Watch {
    /// Runs the board, and records its output.
    pub(super) fn run_until(&mut self, board: &mut Board, until: u64) -> Result<(), Failure> {
        while board.now() < until {
            let next = (board.now() + PER_SECOND / 100).min(until);
            board.run_until(next)?;
            self.take(board);
        }
        Ok(())
    }

    /// Records everything that the board has sent.
    pub(super) fn take(&mut self, board: &mut Board) {
        for TimedByte { time, byte } in board.take_uart() {
            // A reset may cut a frame off before its end: the next frame begins with that end, long after the last
            // byte has left.
            if let Some(Ok(frame)) = self.decoder.push(byte) {
                self.message(self.last_byte, &frame.message);
            }
            if byte != 0 {
                self.last_byte = time;
            }
        }
        for TimedFrame { time, frame } in board.take_can() {
            let Ok(data) = <[u8; 8]>::try_from(frame.data.as_slice()) else {
                if frame.id & !0x7F == 0x700 && frame.data == [0] {
                    self.reported.push((time, Reported::BootUp));
                }
                continue;
            };
            self.frame(time, frame.id, &data);
        }
        board.take_can_requests();
        let read = board.take_transactions();
        let samples = read.iter().filter(|read| parity::is_sample(read));
        self.samples.extend(samples.map(|read| (read.start, read.edge)));
    }

    fn frame(&mut self, time: u64, id: u32, data: &[u8; 8]) {
        if id & !0x7F == 0x080 && id & 0x7F != 0 {
            let emergency = Emergency::decode(data);
            if let Some(fault) = emergency.fault {
                let reported = match emergency.code {
                    0 => Reported::Cleared(fault),
                    _ => Reported::Emergency(fault),
                };
                self.reported.push((time, reported));
            }
        }
        if let Some((Pdo::Contact, _)) = Pdo::from_cob_id(id as u16) {
            let contact = pdo::Contact::decode(data);
            let sample_us = f64::from(contact.timestamp.0) * pdo::TIME_STEP_US as f64;
            let status = contact.status;
            self.contacts.push(ContactFrame {
                line: Line::Can,
                time,
                stable: says_stable(contact.stable.0, status),
                valid: status.is_valid(),
                age_us: (to_us(time) - sample_us).rem_euclid(SHORT_US),
                sample_us: None,
            });
        }
    }

    fn message(&mut self, time: u64, message: &Message) {
        match message {
            Message::Contact(contact) => {
                let sample_us = contact.timestamp.as_micros();
                self.contacts.push(ContactFrame {
                    line: Line::Uart,
                    time,
                    stable: says_stable(contact.stable.0, contact.status),
                    valid: contact.status.is_valid(),
                    age_us: to_us(time) - sample_us as f64,
                    sample_us: Some(sample_us),
                });
            }
            Message::Log(line) => {
                let named = |fault: &Fault| fault.name() == line.text();
                if let Some(fault) = Fault::ALL.into_iter().find(named) {
                    self.reported.push((time, Reported::Serial(fault)));
                }
            }
            Message::Health(health) => {
                for fault in health.faults.iter() {
                    self.reported.push((time, Reported::Serial(fault)));
                }
                self.health.push((time, *health));
            }
            Message::ConfigResponse(response) => {
                if let Answer::Value(value) = response.answer {
                    let bytes = value.as_bytes().to_vec();
                    self.answers.push((response.address, bytes));
                }
            }
            _ => {}
        }
    }

    /// Last answer to a request for a setting.
    pub(super) fn answered(&self, address: Address) -> Option<&[u8]> {
        let mut answers = self.answers.iter().rev();
        let found = answers.find(|(about, _)| *about == address);
        found.map(|(_, value)| value.as_slice())
    }
}

fn says_stable(probability: u16, status: pdo::Status) -> bool {
    status.decision() == Decision::Stable || status.is_valid() && probability >= 0x8000
}
