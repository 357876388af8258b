//! Reception: filters and the two FIFOs.

use super::{BusFrame, Can};

impl Can {
    /// Puts a frame into the FIFO of the filter that accepts it.
    pub(super) fn receive(&mut self, frame: &BusFrame) {
        let identifier = frame.id << 21;
        let Some((fifo, index)) = self.filter(frame, identifier) else {
            return;
        };
        let word = |from: usize| {
            u32::from_le_bytes(core::array::from_fn(|i| {
                frame.data.get(from + i).copied().unwrap_or(0)
            }))
        };
        let entry = [identifier, frame.data.len() as u32 | index << 8, word(0), word(4)];
        if self.fifo[fifo].len() == 3 {
            self.overruns += 1;
            self.fifo_flags[fifo] |= 0x10;
            // Unless the FIFO is locked, the last message is replaced.
            if self.control & 8 == 0 {
                self.fifo[fifo].pop_back();
                self.fifo[fifo].push_back(entry);
            }
            return;
        }
        self.fifo[fifo].push_back(entry);
        if self.fifo[fifo].len() == 3 {
            self.fifo_flags[fifo] |= 8;
        }
    }

    /// FIFO and filter number for a frame, if a filter accepts it.
    fn filter(&self, frame: &BusFrame, wide: u32) -> Option<(usize, u32)> {
        if self.filter_master & 1 != 0 {
            return None;
        }
        let narrow = frame.id << 5;
        let banks = (self.filter_master >> 8 & 0x3F) as usize;
        let mut numbers = [0_u32; 2];
        for (bank, [first, second]) in self.filters.into_iter().enumerate().take(banks.min(28)) {
            let bit = |word: u32| word >> bank & 1 == 1;
            let fifo = usize::from(bit(self.filter_fifo));
            let (list, is_wide) = (bit(self.filter_mode), bit(self.filter_scale));
            let masked = |value: u32, id: u32, mask: u32| (value ^ id) & mask == 0;
            let hits: Vec<bool> = match (is_wide, list) {
                (true, false) => vec![masked(wide, first, second & !1)],
                (true, true) => vec![wide == first & !1, wide == second & !1],
                (false, false) => {
                    [first, second].map(|word| masked(narrow, word & 0xFFFF, word >> 16)).to_vec()
                }
                (false, true) => [first & 0xFFFF, first >> 16, second & 0xFFFF, second >> 16]
                    .map(|id| narrow == id)
                    .to_vec(),
            };
            if bit(self.filter_active)
                && let Some(hit) = hits.iter().position(|&hit| hit)
            {
                return Some((fifo, numbers[fifo] + hit as u32));
            }
            numbers[fifo] += hits.len() as u32;
        }
        None
    }
}
