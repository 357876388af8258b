//! State of the part's bus interface: the output registers and the current transaction.

use crate::register::status_reg;

/// Handling of a new value while a word is half read, as set by `BDU`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Update {
    /// The outputs take it at once.
    Continuous,
    /// It waits until the other half has been read.
    Blocked,
}

/// One 16-bit output.
#[derive(Clone, Copy, Debug, Default)]
struct Word {
    value: i16,
    /// The byte that has been read while the other has not: 0 low, 1 high.
    half_read: Option<u8>,
}

impl Word {
    const fn update(&mut self, value: i16, update: Update) {
        match (update, self.half_read) {
            (Update::Blocked, Some(_)) => {}
            _ => self.value = value,
        }
    }

    fn read(&mut self, half: u8) -> u8 {
        self.half_read = match self.half_read {
            Some(other) if other != half => None,
            _ => Some(half),
        };
        self.value.to_le_bytes()[usize::from(half)]
    }
}

/// The output registers, from `OUT_TEMP_L` to `OUTZ_H_A`, and their data-ready flags.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Words {
    words: [Word; 7],
    pub(super) accel_fresh: bool,
    pub(super) gyro_fresh: bool,
    pub(super) temperature_fresh: bool,
}

impl Words {
    pub(super) fn update_temperature(&mut self, code: i16, update: Update) {
        self.words[0].update(code, update);
        self.temperature_fresh = true;
    }

    pub(super) fn update_gyro(&mut self, codes: Option<[i16; 3]>, update: Update) {
        update_all(&mut self.words[1..4], codes, update);
        self.gyro_fresh = true;
    }

    pub(super) fn update_accel(&mut self, codes: Option<[i16; 3]>, update: Update) {
        update_all(&mut self.words[4..7], codes, update);
        self.accel_fresh = true;
    }

    pub(super) fn status(&self) -> u8 {
        status_reg::XLDA.place(u8::from(self.accel_fresh))
            | status_reg::GDA.place(u8::from(self.gyro_fresh))
            | status_reg::TDA.place(u8::from(self.temperature_fresh))
    }

    /// Reads a byte of an output; reading a high byte clears its sample's data-ready flag.
    pub(super) fn read(&mut self, offset: u8) -> u8 {
        let (word, half) = (offset / 2, offset % 2);
        if half == 1 {
            match word {
                0 => self.temperature_fresh = false,
                1..=3 => self.gyro_fresh = false,
                _ => self.accel_fresh = false,
            }
        }
        self.words[usize::from(word)].read(half)
    }
}

fn update_all(words: &mut [Word], codes: Option<[i16; 3]>, update: Update) {
    for (word, code) in words.iter_mut().zip(codes.into_iter().flatten()) {
        word.update(code, update);
    }
}

/// State of an SPI transaction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Phase {
    /// Chip select is high.
    #[default]
    Idle,
    /// The next byte is an address.
    Address,
    /// The next byte goes to the master.
    Reading(u8),
    /// The next byte comes from the master.
    Writing(u8),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocked_output_waits_until_its_other_half_is_read() {
        for [first, second] in [[0, 1], [1, 0]] {
            let mut word = Word::default();
            let bytes =
                |value: i16| [first, second].map(|half| value.to_le_bytes()[usize::from(half)]);
            word.update(0x0102, Update::Blocked);
            assert_eq!([word.read(first), word.read(first)], [bytes(0x0102)[0]; 2]);
            word.update(0x0304, Update::Blocked);
            assert_eq!(word.read(second), bytes(0x0102)[1]);
            word.update(0x0506, Update::Blocked);
            assert_eq!([word.read(first), word.read(second)], bytes(0x0506));
        }
    }
}
