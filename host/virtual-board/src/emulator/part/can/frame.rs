//! A frame, and its bits on the bus.

/// A data frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusFrame {
    /// Identifier: 11 bits, or 29 if `extended`.
    pub id: u32,
    /// Whether the identifier has 29 bits.
    pub extended: bool,
    /// Whether it requests data instead of carrying it.
    pub remote: bool,
    /// Payload, up to eight bytes.
    pub data: Vec<u8>,
}

impl BusFrame {
    /// A data frame with an identifier of 11 bits.
    #[must_use]
    pub fn new(id: u16, data: &[u8]) -> Self {
        Self {
            id: u32::from(id),
            extended: false,
            remote: false,
            data: data.iter().copied().take(8).collect(),
        }
    }

    /// Rank in arbitration: the lower value wins.
    #[must_use]
    pub const fn rank(&self) -> u64 {
        // Eleven bits, then RTR or SRR, IDE, eighteen bits, RTR.
        if self.extended {
            (self.id as u64 >> 18) << 21
                | 0b11 << 19
                | (self.id as u64 & 0x3_FFFF) << 1
                | self.remote as u64
        } else {
            (self.id as u64) << 21 | (self.remote as u64) << 20
        }
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
        let id = u64::from(self.id);
        if self.extended {
            push(id >> 18, 11);
            push(0b11, 2);
            push(id & 0x3_FFFF, 18);
        } else {
            push(id, 11);
        }
        push(u64::from(self.remote), 1);
        push(0, 2);
        push(length, 4);
        if !self.remote {
            for &byte in &self.data {
                push(u64::from(byte), 8);
            }
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
