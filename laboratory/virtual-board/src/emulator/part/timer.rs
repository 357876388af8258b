//! General-purpose timer: counting up, compare, capture, and counting the captures of another timer.

use std::cell::Cell;

use super::unknown;
use crate::emulator::time::NEVER;

// Offsets of the registers (RM0090, 18.4).
const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCMR2: u32 = 0x1C;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const RCR: u32 = 0x30;
const CCR1: u32 = 0x34;
const CCR4: u32 = 0x40;
const BDTR: u32 = 0x44;
const OR: u32 = 0x50;

// Bits of CR1, SR and EGR.
const CEN: u32 = 1;
const UDIS: u32 = 1 << 1;
const URS: u32 = 1 << 2;
const OPM: u32 = 1 << 3;
const UIF: u32 = 1;

/// Bit in CR2: the input of channel 1 is the XOR of the pins of channels 1 to 3 (TI1S).
const TI1S: u32 = 1 << 7;

/// Master mode with a pulse on the trigger output for each capture of channel 1.
const COMPARE_PULSE: u32 = 3 << 4;

/// Slave mode in which the trigger clocks the counter.
const EXTERNAL_CLOCK: u32 = 7;

/// Filters of a capture: cycles of the timer's clock from one sample to the next, and equal samples that make a level
/// (RM0090, 18.4.7, IC1F; CKD is 0).
const FILTERS: [[u64; 2]; 16] = [
    [1, 1],
    [1, 2],
    [1, 4],
    [1, 8],
    [2, 6],
    [2, 8],
    [4, 6],
    [4, 8],
    [8, 6],
    [8, 8],
    [16, 5],
    [16, 6],
    [16, 8],
    [32, 5],
    [32, 6],
    [32, 8],
];

/// The registers.
#[derive(Clone, Debug, Default)]
pub struct Timer {
    name: &'static str,
    mask: u32,
    control: [u32; 2],
    slave: u32,
    interrupts: u32,
    status: u32,
    modes: [u32; 2],
    enables: u32,
    prescaler: u32,
    /// Active prescaler: the register takes effect at an update.
    dividing: u32,
    reload: u32,
    compares: [u32; 4],
    others: [u32; 5],
    /// Levels at the pins of the channels; one without a pin is low.
    pins: [bool; 4],
    /// Value of the counter at time `since`.
    count: u32,
    since: u64,
    period: u64,
    /// Whether a debugger's halt has frozen the timer.
    frozen: bool,
    /// Count at the first start, with the compare values shifted, as if it had already run that long.
    pub head_start: u32,
    /// Time at which one of the flags with an interrupt is next set, if known.
    next: Cell<Option<u64>>,
}

impl Timer {
    /// Creates a timer of 16 or 32 bits with a clock period of `period`.
    #[must_use]
    pub fn new(name: &'static str, bits: u32, period: u64) -> Self {
        let mask = if bits == 32 { u32::MAX } else { 0xFFFF };
        Self { name, mask, reload: mask, period, ..Self::default() }
    }

    /// Resets the registers.
    pub fn reset(&mut self, period: u64) {
        let bits = self.mask.count_ones();
        *self = Self { head_start: self.head_start, ..Self::new(self.name, bits, period) };
    }

    /// Sets the period of its clock.
    pub fn set_period(&mut self, now: u64, period: u64) {
        self.restart(now);
        self.period = period;
    }

    const fn is_on(&self) -> bool {
        self.control[0] & CEN != 0
    }

    /// Returns whether it counts its own clock.
    const fn runs(&self) -> bool {
        self.is_on() && self.slave & 7 == 0 && !self.frozen
    }

    /// Freezes the timer while a debugger halts the core, or releases it.
    pub fn freeze(&mut self, frozen: bool, now: u64) {
        self.restart(now);
        self.frozen = frozen;
    }

    /// Counts on from `now`; the fraction of a count is lost.
    fn restart(&mut self, now: u64) {
        self.advance(now);
        self.next.set(None);
        self.since = now;
    }

    /// Returns which of the four internal triggers the timer counts instead of its clock, if it counts one.
    #[must_use]
    pub fn counts_trigger(&self) -> Option<u32> {
        let counts = self.is_on() && self.slave & 7 == EXTERNAL_CLOCK;
        counts.then_some(self.slave >> 4 & 7)
    }

    /// Counts a trigger.
    pub fn trigger(&mut self) {
        if self.count == self.reload {
            self.count = 0;
            self.update(false);
        } else {
            self.count = self.count.wrapping_add(1) & self.mask;
        }
    }

    const fn step(&self) -> u64 {
        self.period * (self.dividing as u64 + 1)
    }

    const fn round(&self) -> u64 {
        self.reload as u64 + 1
    }

    const fn is_capture(&self, channel: usize) -> bool {
        self.modes[channel / 2] >> (8 * (channel % 2)) & 3 != 0
    }

    /// Number of counts until the counter next reaches `value`.
    fn steps_to(&self, value: u64) -> u64 {
        let count = u64::from(self.count);
        let round = self.round();
        if value >= round {
            u64::MAX
        } else if count >= round {
            // Above its reload value it counts to the end of its width.
            u64::from(self.mask) + 1 - count + value
        } else if value > count {
            value - count
        } else {
            value + round - count
        }
    }

    /// Time at which one of the flags with an interrupt is next set. It is queried at every event of the chip, and
    /// stays the same until it passes or a register is written.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        let next = self.next.get().unwrap_or_else(|| self.find_next_event());
        self.next.set(Some(next));
        next
    }

    fn find_next_event(&self) -> u64 {
        if !self.runs() {
            return NEVER;
        }
        let update =
            (self.interrupts & UIF != 0 || self.control[0] & OPM != 0).then(|| self.steps_to(0));
        (0..4)
            .filter(|&channel| self.interrupts & 2 << channel != 0 && !self.is_capture(channel))
            .map(|channel| self.steps_to(u64::from(self.compares[channel])))
            .chain(update)
            .filter(|&steps| steps != u64::MAX)
            .map(|steps| self.since + steps * self.step())
            .min()
            .unwrap_or(NEVER)
    }

    /// Advances to `now`.
    pub fn advance(&mut self, now: u64) {
        if self.next.get().is_some_and(|next| next <= now) {
            self.next.set(None);
        }
        if !self.runs() {
            self.since = now;
            return;
        }
        let mut steps = (now - self.since) / self.step();
        while steps > 0 {
            // Stops at an update, which may change the prescaler or stop the timer.
            let to_update = self.steps_to(0).min(steps);
            for channel in 0..4 {
                let compare = u64::from(self.compares[channel]);
                if !self.is_capture(channel) && self.steps_to(compare) <= to_update {
                    self.status |= 2 << channel;
                }
            }
            self.since += to_update * self.step();
            if self.steps_to(0) == to_update {
                self.count = 0;
                self.update(false);
                if !self.runs() {
                    self.since = now;
                    return;
                }
                steps = (now - self.since) / self.step();
            } else {
                self.count += to_update as u32;
                steps -= to_update;
            }
        }
    }

    fn take_head_start(&mut self) {
        let head_start = core::mem::take(&mut self.head_start);
        let mask = self.mask;
        let later = |count: u32| count.wrapping_add(head_start) & mask;
        self.count = later(self.count);
        for channel in 0..4 {
            if !self.is_capture(channel) {
                self.compares[channel] = later(self.compares[channel]);
            }
        }
    }

    fn update(&mut self, by_software: bool) {
        if self.control[0] & UDIS != 0 {
            return;
        }
        self.next.set(None);
        self.dividing = self.prescaler;
        if !(by_software && self.control[0] & URS != 0) {
            self.status |= UIF;
        }
        if !by_software && self.control[0] & OPM != 0 {
            self.control[0] &= !CEN;
        }
    }

    /// Handles an edge at the pin of a channel, whose level then stays for `width`. Returns whether the trigger output
    /// has a pulse.
    pub fn edge(&mut self, channel: usize, high: bool, width: u64, now: u64) -> bool {
        self.advance(now);
        self.pins[channel] = high;
        if self.control[1] & TI1S == 0 || channel == 3 {
            return self.capture(channel, high, width);
        }
        let [first, second, third, _] = self.pins;
        if channel != 0 {
            self.capture(channel, high, width);
        }
        self.capture(0, first ^ second ^ third, width)
    }

    /// Captures an edge at the input of a channel, unless its filter removes it. Returns whether the trigger output has
    /// a pulse.
    fn capture(&mut self, channel: usize, high: bool, width: u64) -> bool {
        let filter = self.modes[channel / 2] >> (8 * (channel % 2) + 4) & 0xF;
        let [divider, samples] = FILTERS[filter as usize];
        // The first sample may be at the edge.
        if width <= (samples - 1) * divider * self.period {
            return false;
        }
        let enable = self.enables >> (4 * channel);
        let falling = enable & 2 != 0;
        let both = enable & 0xA == 0xA;
        let direct = self.modes[channel / 2] >> (8 * (channel % 2)) & 3 == 1;
        if !direct || enable & 1 == 0 || (high == falling && !both) || !self.runs() {
            return false;
        }
        self.compares[channel] = self.count;
        let flag = 2 << channel;
        if self.status & flag != 0 {
            self.status |= 0x200 << channel;
        }
        self.status |= flag;
        channel == 0 && self.control[1] & 0x70 == COMPARE_PULSE
    }

    /// Returns whether the interrupt is requested.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        self.status & self.interrupts & 0x5F != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32, now: u64) -> Result<u32, String> {
        self.advance(now);
        Ok(match offset {
            CR1 => self.control[0],
            CR2 => self.control[1],
            SMCR => self.slave,
            DIER => self.interrupts,
            SR => self.status,
            EGR => 0,
            CCMR1 => self.modes[0],
            CCMR2 => self.modes[1],
            CCER => self.enables,
            CNT => self.count,
            PSC => self.prescaler,
            ARR => self.reload,
            CCR1..=CCR4 => {
                let channel = (offset - CCR1) as usize / 4;
                if self.is_capture(channel) {
                    self.status &= !(2 << channel);
                }
                self.compares[channel]
            }
            RCR | BDTR..=OR => self.others[(offset as usize / 4 + 1) % 5],
            _ => return unknown(self.name, offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        self.advance(now);
        self.next.set(None);
        match offset {
            CR1 => {
                if value & 0x70 != 0 {
                    return Err(format!("{} counts up only", self.name));
                }
                if value & CEN != 0 && !self.runs() {
                    self.since = now;
                    self.take_head_start();
                }
                self.control[0] = value & 0x3FF;
            }
            CR2 => self.control[1] = value,
            // The only modelled slave mode counts the trigger of another timer.
            SMCR if value & 7 != 0 && (value & 7 != EXTERNAL_CLOCK || value & 0x40 != 0) => {
                return Err(format!("{} has no such slave mode", self.name));
            }
            SMCR => self.slave = value,
            DIER if value & 0x7F00 != 0 => {
                return Err(format!("{} does not ask for DMA", self.name));
            }
            DIER => self.interrupts = value,
            // Writing a one leaves a flag unchanged.
            SR => self.status &= value,
            EGR => {
                self.status |= value & 0x1E;
                if value & 1 != 0 {
                    self.count = 0;
                    self.since = now;
                    self.update(true);
                }
            }
            CCMR1 => self.modes[0] = value,
            CCMR2 => self.modes[1] = value,
            CCER => self.enables = value,
            CNT => {
                self.count = value & self.mask;
                self.since = now;
            }
            PSC => self.prescaler = value & 0xFFFF,
            ARR => self.reload = value & self.mask,
            CCR1..=CCR4 => self.compares[(offset - CCR1) as usize / 4] = value & self.mask,
            RCR | BDTR..=OR => self.others[(offset as usize / 4 + 1) % 5] = value,
            _ => return unknown(self.name, offset),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set<const N: usize>(timer: &mut Timer, registers: [(u32, u32); N]) {
        for (offset, value) in registers {
            timer.write(offset, value, 0).expect("a register");
        }
    }

    fn timer() -> Timer {
        let mut timer = Timer::new("TIM", 16, 10);
        set(&mut timer, [(PSC, 9), (ARR, 999), (EGR, 1), (SR, 0)]);
        timer
    }

    #[test]
    fn it_updates_every_reload_plus_one_counts_and_compares() {
        let mut timer = timer();
        set(&mut timer, [(CCR1, 250), (DIER, 3), (CR1, CEN)]);
        assert_eq!(timer.next_event(), 25_000);
        timer.advance(25_000);
        assert!(timer.interrupts());
        timer.write(SR, !2, 25_000).expect("a register");
        assert!(!timer.interrupts());
        assert_eq!(timer.next_event(), 100_000);
        timer.advance(100_000);
        assert_eq!(timer.read(SR, 100_000).expect("a register") & 1, 1);
        assert_eq!(timer.read(CNT, 100_390), Ok(3));
    }

    #[test]
    fn a_passed_compare_value_matches_in_the_next_round() {
        let mut timer = timer();
        set(&mut timer, [(DIER, 2), (CR1, CEN)]);
        timer.write(CCR1, 250, 25_100).expect("a register");
        assert_eq!(timer.next_event(), 125_000);
        timer.advance(100_000);
        assert!(!timer.interrupts());
    }

    #[test]
    fn a_frozen_timer_stands_still() {
        let mut timer = timer();
        set(&mut timer, [(CCR1, 250), (DIER, 2), (CR1, CEN)]);
        timer.freeze(true, 10_000);
        assert_eq!(timer.next_event(), NEVER);
        timer.freeze(false, 1_000_000);
        assert_eq!(timer.read(CNT, 1_000_000), Ok(100));
        assert_eq!(timer.next_event(), 1_015_000);
    }

    #[test]
    fn a_slave_counts_captures_instead_of_its_clock() {
        let mut master = timer();
        set(&mut master, [(CCMR1, 1), (CCER, 1), (CR2, COMPARE_PULSE), (CR1, CEN)]);
        let mut counter = timer();
        set(&mut counter, [(SMCR, 0x17), (ARR, 2), (CR1, CEN)]);
        assert_eq!(counter.counts_trigger(), Some(1));
        let mut counts = Vec::new();
        for edge in 1..=4 {
            // The edge is captured even if the previous one was not read.
            if master.edge(0, true, NEVER, 1000 * edge) {
                counter.trigger();
            }
            assert!(!master.edge(0, false, NEVER, 1000 * edge + 50));
            counts.push(counter.read(CNT, 1000 * edge + 60).expect("a register"));
        }
        assert_eq!(counts, [1, 2, 0, 1]);
        assert!(counter.write(SMCR, 4, 0).is_err());
    }

    #[test]
    fn the_pin_of_channel_3_reaches_channel_1_by_the_exclusive_or() {
        for (control, captured, pulses) in [(COMPARE_PULSE, 0, 0), (COMPARE_PULSE | TI1S, 130, 2)] {
            let mut timer = timer();
            set(&mut timer, [(CCMR1, 1), (CCER, 1), (CR2, control), (CR1, CEN)]);
            let edges = [(true, 12_345), (false, 12_400), (true, 13_000)];
            let given = edges.map(|(high, now)| timer.edge(2, high, NEVER, now));
            assert_eq!(given.iter().filter(|pulse| **pulse).count(), pulses);
            assert_eq!(timer.read(CCR1, 13_000), Ok(captured));
        }
    }

    #[test]
    fn compares_are_shifted_by_the_head_start() {
        let mut timer = timer();
        timer.head_start = 900;
        timer.reset(10);
        set(&mut timer, [(PSC, 9), (CCR1 + 4, 250), (DIER, 5), (EGR, 1), (SR, 0), (CR1, CEN)]);
        assert_eq!(timer.read(CNT, 0), Ok(900));
        assert_eq!(timer.next_event(), 25_000);
        set(&mut timer, [(CR1, 0), (CR1, CEN)]);
        assert_eq!(timer.read(CNT, 0), Ok(900));
    }

    #[test]
    fn a_second_capture_sets_the_overcapture_flag() {
        let mut timer = timer();
        set(&mut timer, [(CCMR1, 1), (CCER, 1), (CR1, CEN)]);
        timer.edge(0, true, NEVER, 12_345);
        timer.edge(0, false, NEVER, 12_400);
        assert_eq!(timer.read(SR, 12_500).expect("a register") & 0x202, 2);
        timer.edge(0, true, NEVER, 13_000);
        assert_eq!(timer.read(SR, 13_000).expect("a register") & 0x202, 0x202);
        assert_eq!(timer.read(CCR1, 13_000), Ok(130));
    }

    #[test]
    fn filter_of_eight_samples_removes_pulses_of_seven() {
        for (mode, shortest) in [(0x01, 1), (0x31, 71), (0xF1, 7 * 32 * 10 + 1)] {
            let mut timer = timer();
            set(&mut timer, [(CCMR1, mode), (CCER, 1), (CR2, COMPARE_PULSE), (CR1, CEN)]);
            assert!(!timer.edge(0, true, shortest - 1, 1_000), "{mode:#x}");
            assert!(timer.edge(0, true, shortest, 2_000), "{mode:#x}");
        }
    }
}
