//! The part's FIFO.

use std::collections::VecDeque;

use crate::fifo::{CAPACITY, WordBytes};
use crate::register::{fifo_data_out_tag, fifo_status2};

/// Mode selected by `FIFO_MODE`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Remains empty.
    Bypass,
    /// Stops when full.
    UntilFull,
    /// Overwrites the oldest word.
    Continuous,
}

impl Mode {
    /// Decodes the mode; modes that wait for a trigger count as their first half.
    pub(super) const fn of(code: u8) -> Self {
        match code {
            0b001 => Self::UntilFull,
            0b011 | 0b110 => Self::Continuous,
            _ => Self::Bypass,
        }
    }
}

/// Words in order, oldest first.
#[derive(Clone, Debug)]
pub(super) struct Fifo {
    words: VecDeque<WordBytes>,
    /// Number of words it holds: less than the capacity if it stops at the watermark.
    depth: u16,
    slot: u8,
    /// Slots since the last timestamp.
    without_timestamp: u8,
    overrun: bool,
    overrun_latched: bool,
}

impl Fifo {
    pub(super) fn new() -> Self {
        Self {
            words: VecDeque::with_capacity(usize::from(CAPACITY)),
            depth: CAPACITY,
            slot: 0,
            without_timestamp: 0,
            overrun: false,
            overrun_latched: false,
        }
    }

    pub(super) fn clear(&mut self) {
        self.words.clear();
        self.slot = 0;
        self.without_timestamp = 0;
        self.overrun = false;
        self.overrun_latched = false;
    }

    /// Starts the next time slot: words pushed from now on belong together.
    pub(super) const fn next_slot(&mut self) {
        self.slot = (self.slot + 1) & 0b11;
    }

    /// `STOP_ON_WTM`: limits the depth to the watermark; `None` is the full capacity.
    pub(super) fn set_depth(&mut self, watermark: Option<u16>) {
        let watermark = watermark.filter(|watermark| *watermark > 0);
        self.depth = watermark.map_or(CAPACITY, |watermark| watermark.min(CAPACITY));
    }

    /// Returns whether this slot gets a timestamp, by `ODR_TS_BATCH` (ST's `DEC_TS_BATCH`).
    pub(super) const fn takes_timestamp(&mut self, code: u8) -> bool {
        let every = match code {
            0 => return false,
            1 => 1,
            2 => 8,
            _ => 32,
        };
        let takes = self.without_timestamp == 0;
        self.without_timestamp = (self.without_timestamp + 1) % every;
        takes
    }

    pub(super) fn push(&mut self, mode: Mode, tag: u8, data: [u8; 6]) {
        if mode == Mode::Bypass {
            return;
        }
        if self.words.len() >= usize::from(self.depth) {
            self.overrun = true;
            self.overrun_latched = true;
            if mode == Mode::UntilFull {
                return;
            }
            self.words.pop_front();
        }
        let tag =
            fifo_data_out_tag::TAG_SENSOR.place(tag) | fifo_data_out_tag::TAG_CNT.place(self.slot);
        let parity = (tag.count_ones() & 1) as u8;
        let [b0, b1, b2, b3, b4, b5] = data;
        self.words.push_back([tag | parity, b0, b1, b2, b3, b4, b5]);
    }

    /// Reads a byte of the oldest word; reading the last byte removes the word.
    pub(super) fn read(&mut self, index: usize) -> u8 {
        let byte = self.words.front().map_or(0, |word| word[index]);
        if index == 6 {
            self.words.pop_front();
            self.overrun = false;
        }
        byte
    }

    pub(super) fn level(&self) -> u16 {
        self.words.len() as u16
    }

    pub(super) fn reached(&self, watermark: u16) -> bool {
        watermark > 0 && self.level() >= watermark
    }

    /// Value of `FIFO_STATUS1`.
    pub(super) fn status1(&self) -> u8 {
        self.level().to_le_bytes()[0]
    }

    /// Value of `FIFO_STATUS2`; reading it clears the latched overrun.
    pub(super) fn status2(&mut self, watermark: u16) -> u8 {
        fifo_status2::DIFF_FIFO.place(self.level().to_le_bytes()[1])
            | fifo_status2::FIFO_WTM_IA.place(u8::from(self.reached(watermark)))
            | fifo_status2::FIFO_FULL_IA.place(u8::from(self.level() >= CAPACITY - 1))
            | fifo_status2::FIFO_OVR_IA.place(u8::from(self.overrun))
            | fifo_status2::OVER_RUN_LATCHED
                .place(u8::from(core::mem::take(&mut self.overrun_latched)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fifo::tag;

    #[test]
    fn full_fifo_drops_its_oldest_word_and_reports_it_once() {
        let mut fifo = Fifo::new();
        for i in 0..=CAPACITY {
            let [low, high] = i.to_le_bytes();
            fifo.push(Mode::Continuous, tag::GYRO, [low, high, 0, 0, 0, 0]);
        }
        assert_eq!(fifo.level(), CAPACITY);
        let status = fifo.status2(0);
        assert!(fifo_status2::OVER_RUN_LATCHED.is_set(status));
        assert!(fifo_status2::FIFO_OVR_IA.is_set(status));
        assert!(!fifo_status2::OVER_RUN_LATCHED.is_set(fifo.status2(0)));
        assert_eq!(fifo.read(1), 1);
    }

    #[test]
    fn cleared_fifo_is_in_its_initial_state() {
        let mut fifo = Fifo::new();
        for _ in 0..=CAPACITY {
            fifo.next_slot();
            fifo.push(Mode::Continuous, tag::GYRO, [1; 6]);
        }
        fifo.clear();
        assert_eq!((fifo.level(), fifo.status1(), fifo.status2(1)), (0, 0, 0));
        // Slot 1 comes first again; slot 0 leaves tag 2 to be made even.
        fifo.next_slot();
        fifo.push(Mode::Continuous, tag::ACCEL, [0; 6]);
        assert_eq!(fifo.read(0), 0x12);
        fifo.clear();
        fifo.push(Mode::Continuous, tag::ACCEL, [0; 6]);
        assert_eq!(fifo.read(0), 0x11);
    }

    #[test]
    fn fifo_mode_keeps_what_came_first() {
        let mut fifo = Fifo::new();
        for i in 0..600_u16 {
            let [low, high] = i.to_le_bytes();
            fifo.push(Mode::UntilFull, tag::GYRO, [low, high, 0, 0, 0, 0]);
        }
        assert_eq!((fifo.level(), fifo.read(1)), (CAPACITY, 0));
    }

    #[test]
    fn fifo_can_stop_at_the_watermark() {
        let mut fifo = Fifo::new();
        fifo.set_depth(Some(10));
        for i in 0..15_u8 {
            fifo.push(Mode::UntilFull, tag::GYRO, [i, 0, 0, 0, 0, 0]);
        }
        assert_eq!((fifo.level(), fifo.read(1)), (10, 0));
        for i in 0..15_u8 {
            fifo.push(Mode::Continuous, tag::GYRO, [i, 0, 0, 0, 0, 0]);
        }
        assert_eq!((fifo.level(), fifo.read(1)), (10, 5));
    }

    #[test]
    fn timestamps_are_decimated_by_slots() {
        for (code, taken) in [(0, 0), (1, 64), (2, 8), (3, 2)] {
            let mut fifo = Fifo::new();
            let count = (0..64).filter(|_| fifo.takes_timestamp(code)).count();
            assert_eq!(count, taken);
        }
    }

    #[test]
    fn word_is_removed_when_its_last_byte_is_read() {
        let mut fifo = Fifo::new();
        fifo.push(Mode::Continuous, tag::ACCEL, [1, 2, 3, 4, 5, 6]);
        assert_eq!(
            core::array::from_fn(|i| fifo.read(i)),
            [0x11, 1, 2, 3, 4, 5, 6]
        );
        assert_eq!((fifo.level(), fifo.read(0)), (0, 0));
    }
}
