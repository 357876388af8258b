//! Bitwise comparison of the ELF's estimates with the host's for the same codes.
//!
//! The codes come from the sensor's bus, and the times of the samples from the messages that the ELF sends over its
//! serial line. The host's estimator runs over both.

use std::collections::VecDeque;

use estimator_core::any::AnyEstimator;
use estimator_core::{ContactEstimate, ParamsError, Stream, Validity};
use lsm6dsox::imu::{Conversion, missing_sample};
use lsm6dsox::{Config, FrozenDetector, RawSample};
use wire::pdo::{P8, P16};
use wire::settings::WINDOW_CAPACITY;
use wire::uart::ContactMessage;
use wire::{Faults, Settings};

use crate::emulator::chip::Transaction;
use crate::emulator::part::can::TimedFrame;
use crate::emulator::time::to_us;

/// Length of a burst: the address of `STATUS_REG`, then sixteen bytes.
const BURST: usize = 17;
const READ_STATUS: u8 = 0x9E;

/// Result of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parity {
    /// Estimates compared.
    pub compared: u64,
    /// Compared estimates based on a sensor sample.
    pub measured: u64,
    /// Compared estimates that differ in any bit.
    pub mismatches: u64,
    /// Compared CAN frames.
    pub can_compared: u64,
    /// Compared CAN frames that differ in any bit of a probability.
    pub can_mismatches: u64,
}

/// One sample as read over the bus.
#[derive(Clone, Copy, Debug)]
struct Burst {
    /// Time of its data-ready edge, µs since power-up.
    edge_us: f64,
    raw: RawSample,
}

/// Returns whether a transaction reads a sample.
#[must_use]
pub fn is_sample(transaction: &Transaction) -> bool {
    transaction.back.len() == BURST && transaction.out.first() == Some(&READ_STATUS)
}

fn burst(transaction: &Transaction) -> Option<Burst> {
    if !is_sample(transaction) {
        return None;
    }
    let (_, bytes) = transaction.back.split_first_chunk::<1>()?;
    Some(Burst {
        edge_us: to_us(transaction.edge?),
        raw: RawSample::decode(bytes.try_into().ok()?, &Config::FRESH_KILOHERTZ).ok()?,
    })
}

/// Number of messages after which the board's clock is determined.
const FOR_CLOCK: usize = 1000;

/// Number of messages, the newest of the [`FOR_CLOCK`], that determine the clock. Earlier ones may have waited while
/// the board started.
const ASKED: usize = 200;

/// Maximum number of messages ahead of the recorded bus and serial line.
const LAG: usize = 32;

/// Maximum number of estimates that a CAN frame may lag behind.
const FRAMES_LAG: usize = 1000;

/// Compares the estimates of a board with the host's as they arrive, for a board with default parameters
/// and a sensor without faults.
pub struct ParityCheck {
    parity: Parity,
    conversion: Conversion,
    estimator: AnyEstimator<WINDOW_CAPACITY>,
    /// After a start the board flags samples until each axis has changed.
    changes: FrozenDetector,
    /// Offset of the board's clock behind virtual time, µs, once known.
    offset: Option<f64>,
    bursts: VecDeque<Burst>,
    /// Messages of the serial line, with the times at which their first bytes left, in units of
    /// [`time`](crate::emulator::time).
    contacts: VecDeque<(u64, ContactMessage)>,
    frames: VecDeque<TimedFrame>,
    /// Recent estimates in the short form of CAN, as far back as a frame may be.
    short: VecDeque<([u8; 2], [u8; 4])>,
}

impl ParityCheck {
    /// Creates an empty comparison.
    ///
    /// # Errors
    /// Never with default parameters.
    pub fn new() -> Result<Self, ParamsError> {
        let config = Settings::default().params().validate(Stream::KILOHERTZ)?;
        Ok(Self {
            parity: Parity::default(),
            conversion: Conversion::new(&Config::FRESH_KILOHERTZ),
            estimator: AnyEstimator::new(&config),
            changes: FrozenDetector::new(),
            offset: None,
            bursts: VecDeque::new(),
            contacts: VecDeque::new(),
            frames: VecDeque::new(),
            short: VecDeque::new(),
        })
    }

    /// Adds transactions on the sensor's bus.
    pub fn bus(&mut self, transactions: &[Transaction]) {
        self.bursts.extend(transactions.iter().filter_map(burst));
    }

    /// Adds a message sent over the serial line, in order. Its first byte left at `began`, in units of
    /// [`time`](crate::emulator::time).
    pub fn contact(&mut self, began: u64, message: ContactMessage) {
        self.contacts.push_back((began, message));
        if self.offset.is_none() && self.contacts.len() >= FOR_CLOCK {
            self.find_clock();
        }
        while self.offset.is_some() && self.contacts.len() > LAG {
            self.compare_contact();
        }
    }

    /// Adds a CAN frame with an estimate, in order.
    pub fn frame(&mut self, frame: TimedFrame) {
        self.frames.push_back(frame);
        while self.offset.is_some() && self.frames.len() > 2 * LAG {
            self.compare_frame();
        }
    }

    /// Returns the result, once everything was sent.
    #[must_use]
    pub fn finish(mut self) -> Parity {
        if self.offset.is_none() {
            self.find_clock();
        }
        while self.offset.is_some() && !self.contacts.is_empty() {
            self.compare_contact();
        }
        while self.offset.is_some() && !self.frames.is_empty() {
            self.compare_frame();
        }
        self.parity
    }

    fn find_clock(&mut self) {
        self.offset = clock_offset(self.bursts.make_contiguous(), self.contacts.make_contiguous());
    }

    fn compare_contact(&mut self) {
        let (Some((_, message)), Some(offset)) = (self.contacts.pop_front(), self.offset) else {
            return;
        };
        let at = message.timestamp.as_micros() as f64 + offset;
        let old = self.bursts.iter();
        let old = old.take_while(|burst| burst.edge_us < at - 1.0).count();
        self.bursts.drain(..old);
        let burst = self.bursts.pop_front_if(|burst| burst.edge_us < at + 2.0);
        let mut sample = match &burst {
            Some(burst) => self.conversion.imu_sample(&burst.raw, message.timestamp),
            None => missing_sample(message.timestamp),
        };
        if let Some(burst) = &burst
            && !self.changes.every_axis_has_changed()
        {
            if !burst.raw.is_saturated() {
                self.changes.update(&burst.raw);
            }
            if !self.changes.every_axis_has_changed() {
                sample.validity = Validity::Stale;
            }
        }
        let estimate = self.estimator.update(&sample, None);
        self.short.push_back(short_form(&estimate));
        if self.short.len() > FRAMES_LAG + 2 * LAG {
            self.short.pop_front();
        }
        let parity = &mut self.parity;
        parity.compared += 1;
        parity.measured += u64::from(burst.is_some());
        let expected = ContactMessage::new(&estimate, Faults::NONE);
        parity.mismatches += u64::from(bits(&expected) != bits(&message));
    }

    /// Matches a frame with the next estimate of its short time. Frames and estimates are in order of time.
    fn compare_frame(&mut self) {
        let Some(TimedFrame { frame, .. }) = self.frames.pop_front() else {
            return;
        };
        let Ok(bytes) = <[u8; 8]>::try_from(frame.data.as_slice()) else {
            return;
        };
        let time = [bytes[4], bytes[5]];
        let found = self.short.iter().take(FRAMES_LAG);
        let Some(index) = found.map(|(at, _)| *at).position(|at| at == time) else {
            // Without a serial message of the same time there is nothing to compare with.
            return;
        };
        self.short.drain(..index);
        self.parity.can_compared += 1;
        self.parity.can_mismatches += u64::from(self.short[0].1 != bytes[..4]);
    }
}

/// Bytes 4 and 5 of the CAN frame, the sample's time, and bytes 0 to 3, its probabilities.
fn short_form(estimate: &ContactEstimate) -> ([u8; 2], [u8; 4]) {
    // 16 bits of 10 µs.
    let time = (estimate.timestamp.as_micros() / 10) as u16;
    let probabilities = &estimate.probabilities;
    let [low, high] = P16::new(probabilities.stable).0.to_le_bytes();
    let part = [P8::new(probabilities.tangential).0, P8::new(probabilities.vertical).0];
    (time.to_le_bytes(), [low, high, part[0], part[1]])
}

/// Returns the fields of a message that depend only on the estimate. The phase also depends on the load.
fn bits(message: &ContactMessage) -> ([u16; 9], u8) {
    let [ax, ay, az, wx, wy, wz] = message.axes.to_array();
    let (stable, tangential, vertical) = (message.stable, message.tangential, message.vertical);
    let codes = [stable, tangential, vertical, ax, ay, az, wx, wy, wz];
    (codes.map(|code| code.0), message.flags)
}

/// Delay of the board's clock relative to virtual time, µs. A message belongs to the last edge before it was sent, unless
/// it had to wait. Most messages do not wait, so the most frequent delay is used.
fn clock_offset(bursts: &[Burst], sent: &[(u64, ContactMessage)]) -> Option<f64> {
    let offsets: Vec<f64> = sent
        .iter()
        .rev()
        .take(ASKED)
        .filter_map(|(began, message)| {
            let began = to_us(*began);
            let index = bursts.partition_point(|burst| burst.edge_us < began);
            let burst = bursts.get(index.checked_sub(1)?)?;
            Some(burst.edge_us - message.timestamp.as_micros() as f64)
        })
        .collect();
    let supporters = |offset: &f64| {
        let near = offsets.iter().filter(|other| (*other - offset).abs() < 1.5);
        near.count()
    };
    // Takes the latest of equal offsets, for the same result in every run.
    offsets.iter().copied().max_by_key(supporters)
}
