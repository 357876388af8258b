//! A frame, and its bits on the bus.

use wire::{CanFrame, slcan};

/// A data frame with an identifier of 11 bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusFrame {
    /// Identifier.
    pub id: u32,
    /// Payload, up to eight bytes.
    pub data: Vec<u8>,
}

impl BusFrame {
    /// A frame with at most eight bytes of the data.
    #[must_use]
    pub fn new(id: u16, data: &[u8]) -> Self {
        Self { id: u32::from(id), data: data.iter().copied().take(8).collect() }
    }

    /// The frame of a node of the workspace.
    #[must_use]
    pub fn of(frame: &CanFrame) -> Self {
        Self::new(frame.id(), frame.data())
    }

    /// Its line as an slcan adapter sends it, with CR.
    #[must_use]
    pub fn line(&self) -> Vec<u8> {
        let frame = CanFrame::new(self.id as u16, &self.data);
        frame.map_or_else(Vec::new, |frame| slcan::encode(&frame).to_vec())
    }

    /// Number of bits on the bus, with stuff bits and the three bits between frames.
    #[must_use]
    pub fn bits(&self) -> u64 {
        let mut bits = Vec::with_capacity(128);
        let mut push = |value: u64, count: u32| {
            bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
        };
        push(0, 1);
        let length = self.data.len() as u64;
        push(u64::from(self.id), 11);
        // RTR, IDE, and a reserved bit.
        push(0, 3);
        push(length, 4);
        for &byte in &self.data {
            push(u64::from(byte), 8);
        }
        let crc = bits.iter().fold(0_u32, |crc, &bit| {
            let out = crc >> 14 & 1 == 1;
            let crc = crc << 1 & 0x7FFF;
            if out == bit { crc } else { crc ^ 0x4599 }
        });
        bits.extend((0..15).rev().map(|bit| crc >> bit & 1 == 1));
        let (mut stuffed, mut run, mut last) = (0, 0, None);
        for bit in bits {
            stuffed += 1;
            run = if last == Some(bit) { run + 1 } else { 1 };
            last = Some(bit);
            if run == 5 {
                stuffed += 1;
                (run, last) = (1, Some(!bit));
            }
        }
        // CRC delimiter, acknowledge and its delimiter, end of frame, intermission.
        stuffed + 1 + 2 + 7 + 3
    }
}

/// A frame on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedFrame {
    /// Time of its end, in units of [`time`](crate::emulator::time).
    pub time: u64,
    /// The frame.
    pub frame: BusFrame,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_of_eight_bytes_has_the_specified_length() {
        // 111 bits and intermission without a stuffed bit; at most 24 of them with 8 bytes.
        let plain = BusFrame::new(0x555, &[0x55; 8]).bits();
        let stuffed = BusFrame::new(0, &[0; 8]).bits();
        assert!((111..=113).contains(&plain), "{plain}");
        assert!((125..=135).contains(&stuffed), "{stuffed}");
    }
}
