//! The ART accelerator between the core and flash (RM0090, 3.5.2): the cost of a fetch from flash.
//!
//! Flash is read by lines of 128 bits, and each read takes one cycle and the wait states. A line is available at once
//! if it is the present one, or in a cache. With prefetch on, the next line in order is read ahead. A line that had to
//! be waited for enters the cache, but not one that was read ahead: according to the manual the cache holds the targets
//! of branches. Both caches are modelled as fully associative, and the least recently used line is replaced (the manual
//! names the policy, but not the sets). A read that has begun ends before the next one begins.

use crate::emulator::memory::FLASH;

/// Size of a line as a shift, bytes.
const LINE: u32 = 4;

/// Number of lines of the instruction cache, and of the literal cache.
const INSTRUCTION_LINES: u8 = 64;
const DATA_LINES: u8 = 8;

/// Number of lines in flash.
const LINES: usize = FLASH.size >> LINE;

/// Bit in `FLASH_ACR`: the next line is read ahead.
pub const PREFETCH: u32 = 1 << 8;
const INSTRUCTION_CACHE: u32 = 1 << 9;
const DATA_CACHE: u32 = 1 << 10;
const INSTRUCTION_RESET: u32 = 1 << 11;
const DATA_RESET: u32 = 1 << 12;

/// Head of the list of slots in order of use; as the slot of a line: the line is not in the cache.
const HEAD: u8 = 0xFF;

/// A slot of a cache: the line in it, and its neighbours in order of use.
#[derive(Clone, Copy, Debug)]
struct Slot {
    line: u32,
    newer: u8,
    older: u8,
}

/// An empty list.
const UNLINKED: Slot = Slot { line: 0, newer: HEAD, older: HEAD };

/// A cache of lines; the least recently used one is replaced.
#[derive(Clone, Debug)]
struct Cache {
    /// Slot of each line of flash.
    slot_of: Vec<u8>,
    /// A ring in order of use, so that neither a use nor a replacement has to search. `older` of the head is the newest
    /// slot, `newer` of the head the oldest. There are as many slots as an index has values, so no index is out of bounds.
    slots: Box<[Slot; 256]>,
    /// Number of slots in use, from the first.
    used: u8,
    capacity: u8,
}

impl Cache {
    fn new(capacity: u8) -> Self {
        Self { slot_of: vec![HEAD; LINES], slots: Box::new([UNLINKED; 256]), used: 0, capacity }
    }

    fn clear(&mut self) {
        for slot in &self.slots[..usize::from(self.used)] {
            self.slot_of[slot.line as usize] = HEAD;
        }
        self.used = 0;
        self.slots[usize::from(HEAD)] = UNLINKED;
    }

    fn holds(&self, line: u32) -> bool {
        self.slot_of.get(line as usize).is_some_and(|&slot| slot != HEAD)
    }

    /// Uses a line. Returns whether it was in the cache.
    fn take(&mut self, line: u32) -> bool {
        let slot = self.slot_of.get(line as usize).copied().unwrap_or(HEAD);
        if slot == HEAD {
            return false;
        }
        if slot != self.slots[usize::from(HEAD)].older {
            self.unlink(slot);
            self.link(slot);
        }
        true
    }

    /// Fills a slot with a line of flash that no slot holds.
    fn fill(&mut self, line: u32) {
        if line as usize >= LINES {
            return;
        }
        let mut slot = self.used;
        if self.used < self.capacity {
            self.used += 1;
        } else {
            slot = self.slots[usize::from(HEAD)].newer;
            self.unlink(slot);
            self.slot_of[self.slots[usize::from(slot)].line as usize] = HEAD;
        }
        self.slots[usize::from(slot)].line = line;
        self.slot_of[line as usize] = slot;
        self.link(slot);
    }

    fn unlink(&mut self, slot: u8) {
        let Slot { newer, older, .. } = self.slots[usize::from(slot)];
        self.slots[usize::from(newer)].older = older;
        self.slots[usize::from(older)].newer = newer;
    }

    /// Links a slot as the newest.
    fn link(&mut self, slot: u8) {
        let older = core::mem::replace(&mut self.slots[usize::from(HEAD)].older, slot);
        self.slots[usize::from(older)].newer = slot;
        let linked = &mut self.slots[usize::from(slot)];
        (linked.newer, linked.older) = (HEAD, older);
    }
}

/// A load from flash whose address is known from the code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Literal {
    /// Offset of the instruction from the block's start, bytes.
    pub offset: u32,
    /// Address that is read.
    pub address: u32,
}

/// A straight run of instructions that is about to execute.
#[derive(Clone, Copy, Debug)]
pub struct StraightRun<'a> {
    /// Start address.
    pub address: u32,
    /// Length, bytes.
    pub size: u32,
    /// Cycles without waiting for flash.
    pub cycles: u32,
    /// Loads from flash, in order.
    pub literals: &'a [Literal],
}

/// State of the caches and of the current read.
#[derive(Clone, Debug)]
pub struct Accelerator {
    access: u32,
    instructions: Cache,
    data: Cache,
    current: u32,
    /// Line that is read ahead, and the cycle from which its fetch does not wait.
    ahead: Option<(u32, u64)>,
    /// Cycle until which flash is busy with a read.
    busy_until: u64,
}

impl Default for Accelerator {
    fn default() -> Self {
        Self {
            access: 0,
            instructions: Cache::new(INSTRUCTION_LINES),
            data: Cache::new(DATA_LINES),
            current: u32::MAX,
            ahead: None,
            busy_until: 0,
        }
    }
}

impl Accelerator {
    /// Resets the state: caches off and empty.
    pub fn reset(&mut self) {
        self.access = 0;
        self.instructions.clear();
        self.data.clear();
        self.forget();
    }

    /// Discards lines that were read, as flash has changed.
    pub const fn forget(&mut self) {
        self.current = u32::MAX;
        self.ahead = None;
    }

    /// Applies a value of `FLASH_ACR`.
    ///
    /// # Errors
    /// If a cache is reset while it is on, which the part ignores.
    pub fn configure(&mut self, access: u32) -> Result<(), String> {
        let both = |reset: u32, enable: u32| access & reset != 0 && access & enable != 0;
        if both(INSTRUCTION_RESET, INSTRUCTION_CACHE) || both(DATA_RESET, DATA_CACHE) {
            return Err("a cache of flash is reset while it is on".into());
        }
        if access & INSTRUCTION_RESET != 0 {
            self.instructions.clear();
        }
        if access & DATA_RESET != 0 {
            self.data.clear();
        }
        self.access = access;
        Ok(())
    }

    const fn wait_states(&self) -> u64 {
        (self.access & 7) as u64
    }

    /// Starts the read of a line as soon as possible. Returns the cycle from which its fetch does not wait.
    fn read(&mut self, at: u64) -> u64 {
        let start = at.max(self.busy_until);
        self.busy_until = start + self.wait_states() + 1;
        start + self.wait_states()
    }

    /// Fetches a line of instructions other than the current one, at a cycle. Returns the number of wait cycles.
    fn line(&mut self, at: impl Fn() -> u64, line: u32) -> u64 {
        let cached = self.access & INSTRUCTION_CACHE != 0;
        let wait = match self.ahead {
            Some((ahead, ready)) if ahead == line => ready.saturating_sub(at()),
            _ if cached && self.instructions.take(line) => 0,
            _ => {
                let at = at();
                let ready = self.read(at);
                if cached {
                    self.instructions.fill(line);
                }
                ready - at
            }
        };
        self.current = line;
        self.ahead = None;
        let next = line + 1;
        if self.access & PREFETCH != 0 && !(cached && self.instructions.holds(next)) {
            let ready = self.read(at() + wait);
            self.ahead = Some((next, ready));
        }
        wait
    }

    /// Loads a literal at a cycle. Returns the number of wait cycles.
    fn load(&mut self, at: impl Fn() -> u64, line: u32) -> u64 {
        let cached = self.access & DATA_CACHE != 0;
        if cached && self.data.take(line) {
            return 0;
        }
        let at = at();
        let ready = self.read(at);
        if cached {
            self.data.fill(line);
        }
        ready - at
    }

    /// Fetches a run that begins at a cycle. Returns the number of cycles the core waits for flash in it.
    pub fn fetch(&mut self, at: u64, run: &StraightRun) -> u64 {
        let from = run.address.wrapping_sub(FLASH.start);
        let (first, last) = (from >> LINE, (from + run.size.max(1) - 1) >> LINE);
        // The cycle of an instruction is interpolated by the bytes before it.
        let into = |offset: u32| u64::from(run.cycles * offset / run.size.max(1));
        let mut literals = run.literals;
        let mut wait = 0;
        for line in first..=last {
            if line != self.current {
                let offset = (line << LINE).saturating_sub(from);
                wait += self.line(|| at + wait + into(offset), line);
            }
            let end = ((line + 1) << LINE) - from;
            while let [literal, others @ ..] = literals
                && literal.offset < end
            {
                literals = others;
                let line = literal.address.wrapping_sub(FLASH.start) >> LINE;
                if (line as usize) < LINES {
                    wait += self.load(|| at + wait + into(literal.offset), line);
                }
            }
        }
        wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL_ON: u32 = 5 | PREFETCH | INSTRUCTION_CACHE | DATA_CACHE;

    fn accelerator(access: u32) -> Accelerator {
        let mut accelerator = Accelerator::default();
        accelerator.configure(access).expect("a setting");
        accelerator
    }

    /// A run of instructions of four bytes and a cycle each.
    const fn run(line: u32, lines: u32) -> StraightRun<'static> {
        StraightRun {
            address: FLASH.start + (line << LINE),
            size: lines << LINE,
            cycles: lines << 2,
            literals: &[],
        }
    }

    #[test]
    fn without_caches_each_line_costs_the_wait_states() {
        let mut accelerator = accelerator(5);
        assert_eq!(accelerator.fetch(0, &run(0, 4)), 4 * 5);
        assert_eq!(accelerator.fetch(100, &run(0, 4)), 4 * 5);
    }

    #[test]
    fn prefetch_hides_all_but_the_excess_of_flash_time() {
        // A line of four instructions every six cycles: two of them are wait cycles.
        let mut accelerator = accelerator(5 | PREFETCH);
        assert_eq!(accelerator.fetch(0, &run(0, 1)), 5);
        assert_eq!(accelerator.fetch(9, &run(1, 10)), 10 * 2);
        // With three wait states there is no wait.
        let mut accelerator = self::accelerator(3 | PREFETCH);
        assert_eq!(accelerator.fetch(0, &run(0, 10)), 3);
    }

    #[test]
    fn loops_wait_once_if_they_fit_the_cache() {
        let round = |lines: u32, accelerator: &mut Accelerator, at: &mut u64| {
            let mut wait = 0;
            for line in 0..lines {
                // Every other line, so that nothing is read ahead of use.
                let taken = accelerator.fetch(*at, &run(2 * line, 1));
                *at += 20 + taken;
                wait += taken;
            }
            wait
        };
        for (lines, again) in [(64, 0), (65, 65 * 5)] {
            let (mut accelerator, mut at) = (accelerator(ALL_ON & !PREFETCH), 0);
            let first = round(lines, &mut accelerator, &mut at);
            assert_eq!(first, u64::from(lines) * 5);
            assert_eq!(round(lines, &mut accelerator, &mut at), again, "{lines}");
        }
    }

    #[test]
    fn prefetched_lines_stay_out_of_the_cache() {
        let mut accelerator = accelerator(ALL_ON);
        assert_eq!(accelerator.fetch(0, &run(0, 2)), 5 + 2);
        assert_eq!(accelerator.fetch(100, &run(0, 1)), 0, "a target of a branch");
        assert_eq!(accelerator.fetch(200, &run(1, 1)), 0, "read ahead again");
        assert_eq!(accelerator.fetch(300, &run(9, 1)), 5);
        assert_eq!(accelerator.fetch(400, &run(1, 1)), 5, "now a target itself");
    }

    #[test]
    fn literals_have_a_cache_of_eight_lines() {
        let mut accelerator = accelerator(ALL_ON);
        let mut wait = |line: u32, at: u64| {
            let literals = [Literal { offset: 0, address: FLASH.start + (line << LINE) }];
            let run = StraightRun { literals: &literals, ..run(0, 1) };
            accelerator.fetch(at, &run)
        };
        wait(100, 0);
        assert_eq!(wait(100, 100), 0);
        for line in 101..109 {
            assert_eq!(wait(line, 100 * u64::from(line)), 5);
        }
        assert_eq!(wait(100, 100_000), 5);
    }

    #[test]
    fn a_cache_can_be_reset_only_while_it_is_off() {
        let mut accelerator = accelerator(ALL_ON);
        accelerator.fetch(0, &run(0, 1));
        assert!(accelerator.configure(ALL_ON | INSTRUCTION_RESET).is_err());
        let off = ALL_ON & !INSTRUCTION_CACHE & !PREFETCH;
        accelerator.configure(off | INSTRUCTION_RESET).expect("off");
        accelerator.configure(ALL_ON).expect("on");
        accelerator.forget();
        assert_eq!(accelerator.fetch(100, &run(0, 1)), 5);
    }
}
