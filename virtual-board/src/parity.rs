//! Whether the ELF computes what the host computes from the same codes, bit for bit.
//!
//! The codes are taken from the sensor's bus, the times of the samples from the messages that the
//! ELF sends over its serial line; the host's estimator runs over both.

use estimator_core::{
    ContactEstimate, ContactEstimator, ImuSample, Saturation, Timestamp, Validity,
};
use lsm6dsox::scale::{AccelFullScale, Codes, FullScale, GyroFullScale};
use wire::pdo::{P8, P16};
use wire::settings::WINDOW_CAPACITY;
use wire::uart::{ContactMessage, RawSample};
use wire::{Faults, Settings};

use crate::chip::Transaction;
use crate::part::can::TimedFrame;
use crate::time::to_us;

/// What the firmware sets.
const FORCE: AccelFullScale = AccelFullScale::G16;
const RATE: GyroFullScale = GyroFullScale::Dps2000;

/// A burst: the address of `STATUS_REG` to read, then sixteen bytes.
const BURST: usize = 17;
const READ_STATUS: u8 = 0x9E;

/// A message that the board has sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SentContact {
    /// When its first byte left, in units of [`time`](crate::time).
    pub began: u64,
    /// The message.
    pub message: ContactMessage,
}

/// What the comparison came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parity {
    /// Estimates compared.
    pub compared: u64,
    /// Those with a sample of the sensor behind them.
    pub measured: u64,
    /// Those that differ in any bit.
    pub mismatches: u64,
    /// The first of those: the sample's time, µs.
    pub first_mismatch_us: Option<u64>,
    /// Frames of CAN compared.
    pub can_compared: u64,
    /// Those that differ in any bit of a probability.
    pub can_mismatches: u64,
}

/// One sample as it went over the bus.
#[derive(Clone, Copy, Debug)]
struct Burst {
    /// When its data-ready edge was, µs since power-up.
    edge_us: f64,
    status: u8,
    rate: [i16; 3],
    force: [i16; 3],
}

/// Whether a transaction reads a sample.
#[must_use]
pub fn is_sample(transaction: &Transaction) -> bool {
    transaction.back.len() == BURST && transaction.out.first() == Some(&READ_STATUS)
}

fn burst(transaction: &Transaction) -> Option<Burst> {
    if !is_sample(transaction) {
        return None;
    }
    let word = |at: usize| i16::from_le_bytes([transaction.back[at], transaction.back[at + 1]]);
    Some(Burst {
        edge_us: to_us(transaction.edge?),
        status: transaction.back[1],
        // The address, the status, a reserved byte and the temperature come first.
        rate: [word(5), word(7), word(9)],
        force: [word(11), word(13), word(15)],
    })
}

/// Compares what was sent with what the host computes, for a board with its default settings
/// and a sensor without faults; `frames` are those of CAN that hold an estimate.
#[must_use]
pub fn compare(
    transactions: &[Transaction],
    sent: &[SentContact],
    frames: &[TimedFrame],
) -> Parity {
    let mut parity = Parity::default();
    let bursts: Vec<Burst> = transactions.iter().filter_map(burst).collect();
    let Some(offset) = clock_offset(&bursts, sent) else {
        return parity;
    };
    let Ok(params) = Settings::default().params().validate() else {
        return parity;
    };
    let mut estimator = ContactEstimator::<WINDOW_CAPACITY>::new(&params);
    let mut next = bursts.iter().peekable();
    let mut short = Vec::with_capacity(sent.len());
    for SentContact { message, .. } in sent {
        let at = message.timestamp.as_micros() as f64 + offset;
        while next.next_if(|burst| burst.edge_us < at - 1.0).is_some() {}
        let burst = next.next_if(|burst| burst.edge_us < at + 2.0);
        let sample = burst.map_or_else(
            || missing(message.timestamp),
            |burst| sample(burst, message.timestamp),
        );
        let estimate = estimator.update(&sample, None);
        let expected = expected(&estimate);
        short.push(short_form(&estimate));
        parity.compared += 1;
        parity.measured += u64::from(burst.is_some());
        if bits(&expected) != bits(message) {
            parity.mismatches += 1;
            parity
                .first_mismatch_us
                .get_or_insert(message.timestamp.as_micros());
        }
    }
    // Both are in order of time; a frame belongs to the next estimate of its short time.
    let mut place = 0;
    for TimedFrame { frame, .. } in frames {
        let Ok(bytes) = <[u8; 8]>::try_from(frame.data.as_slice()) else {
            continue;
        };
        let ahead = short.iter().skip(place).take(1000);
        let time = [bytes[4], bytes[5]];
        let Some(found) = ahead.clone().position(|(at, _)| *at == time) else {
            continue;
        };
        place += found;
        let same = short
            .get(place)
            .is_some_and(|(_, probabilities)| *probabilities == bytes[..4]);
        parity.can_compared += 1;
        parity.can_mismatches += u64::from(!same);
    }
    parity
}

/// Bytes 4 and 5 of the frame of CAN, the sample's time, and 0 to 3, its probabilities.
fn short_form(estimate: &ContactEstimate) -> ([u8; 2], [u8; 4]) {
    // 16 bits of 10 µs.
    let time = (estimate.timestamp.as_micros() / 10) as u16;
    let probabilities = &estimate.probabilities;
    let [low, high] = P16::new(probabilities.stable).0.to_le_bytes();
    let part = [
        P8::new(probabilities.tangential).0,
        P8::new(probabilities.vertical).0,
    ];
    (time.to_le_bytes(), [low, high, part[0], part[1]])
}

fn expected(estimate: &ContactEstimate) -> ContactMessage {
    ContactMessage::new(estimate, Faults::NONE)
}

/// What of a message is the estimate: not its phase, which also rests on the load.
fn bits(message: &ContactMessage) -> ([u16; 9], u8) {
    let [ax, ay, az, wx, wy, wz] = message.axes.to_array();
    let codes = [
        message.stable,
        message.tangential,
        message.vertical,
        ax,
        ay,
        az,
        wx,
        wy,
        wz,
    ];
    (codes.map(|code| code.0), message.flags)
}

fn sample(burst: &Burst, timestamp: Timestamp) -> ImuSample {
    let force = saturated(burst.force, FORCE);
    let rate = saturated(burst.rate, RATE);
    let validity = match (burst.status & 3 == 3, force, rate) {
        (false, _, _) => Validity::Stale,
        (true, false, false) => Validity::Valid,
        (true, true, false) => Validity::Saturated(Saturation::Accelerometer),
        (true, false, true) => Validity::Saturated(Saturation::Gyroscope),
        (true, true, true) => Validity::Saturated(Saturation::Both),
    };
    RawSample {
        timestamp,
        validity,
        acceleration: burst.force,
        rate: burst.rate,
        acceleration_scale: FORCE.sensitivity(),
        rate_scale: RATE.sensitivity(),
        ..RawSample::default()
    }
    .to_si()
}

fn saturated<S: FullScale>(codes: [i16; 3], full_scale: S) -> bool {
    Codes { codes, full_scale }.is_saturated()
}

fn missing(timestamp: Timestamp) -> ImuSample {
    RawSample {
        timestamp,
        validity: Validity::Invalid,
        ..RawSample::default()
    }
    .to_si()
}

/// How far the board's clock is behind the virtual one, µs. A message belongs to the last edge
/// before it was sent, unless it had to wait; most do not, and their offset is the one.
fn clock_offset(bursts: &[Burst], sent: &[SentContact]) -> Option<f64> {
    let offsets: Vec<f64> = sent
        .iter()
        .rev()
        .take(200)
        .filter_map(|sent| {
            let began = to_us(sent.began);
            let place = bursts.partition_point(|burst| burst.edge_us < began);
            let burst = bursts.get(place.checked_sub(1)?)?;
            Some(burst.edge_us - sent.message.timestamp.as_micros() as f64)
        })
        .collect();
    let supporters = |offset: f64| {
        let near = offsets.iter().filter(|other| (*other - offset).abs() < 1.5);
        near.count()
    };
    // The latest of equals, to be one and the same in every run.
    offsets
        .iter()
        .copied()
        .max_by_key(|&offset| supporters(offset))
}
