//! Pending, enabled and active exceptions, and the selection of the next one (ARMv7-M, B1.5 and B3.4).

/// Exceptions of the core itself.
pub mod exception {
    /// Non-maskable interrupt.
    pub const NMI: u16 = 2;
    /// Hard fault.
    pub const HARD_FAULT: u16 = 3;
    /// Memory management fault.
    pub const MEM_MANAGE: u16 = 4;
    /// Bus fault.
    pub const BUS_FAULT: u16 = 5;
    /// Usage fault.
    pub const USAGE_FAULT: u16 = 6;
    /// Supervisor call.
    pub const SV_CALL: u16 = 11;
    /// Pended call.
    pub const PEND_SV: u16 = 14;
    /// The system timer.
    pub const SYS_TICK: u16 = 15;
    /// The first interrupt.
    pub const INTERRUPT: u16 = 16;
}

/// Number of interrupts of an STM32F405.
pub const INTERRUPTS: usize = 82;
const EXCEPTIONS: usize = 16 + INTERRUPTS;

/// Implemented bits of a priority: four.
const PRIORITY_BITS: u8 = 0xF0;

/// The priority of code that no exception interrupted.
pub const THREAD: i16 = 256;

/// The interrupt controller and the core's own exceptions.
#[derive(Clone, Debug)]
pub struct Nvic {
    pending: [bool; EXCEPTIONS],
    enabled: [bool; EXCEPTIONS],
    priority: [u8; EXCEPTIONS],
    /// Levels of the interrupt lines, one bit each.
    lines: u128,
    /// Active exceptions, the latest last.
    pub(crate) active: Vec<u16>,
    /// `PRIGROUP` of AIRCR.
    group: u8,
    /// The exception to take next, and its group priority, masks ignored.
    pub(crate) next: Option<(u16, i16)>,
}

impl Default for Nvic {
    fn default() -> Self {
        use exception::{HARD_FAULT, NMI, PEND_SV, SV_CALL, SYS_TICK};
        let mut enabled = [false; EXCEPTIONS];
        // Exceptions without an enable bit are always enabled.
        for number in [NMI, HARD_FAULT, SV_CALL, PEND_SV, SYS_TICK] {
            enabled[usize::from(number)] = true;
        }
        Self {
            pending: [false; EXCEPTIONS],
            enabled,
            priority: [0; EXCEPTIONS],
            lines: 0,
            active: Vec::new(),
            group: 0,
            next: None,
        }
    }
}

impl Nvic {
    fn update(&mut self) {
        self.next = (2..EXCEPTIONS)
            .filter(|&number| self.pending[number] && self.enabled[number])
            .map(|number| number as u16)
            .min_by_key(|&number| (self.full_priority(number), number))
            .map(|number| (number, self.priority_of(number)));
    }

    const fn full_priority(&self, number: u16) -> i16 {
        match number {
            exception::NMI => -2,
            exception::HARD_FAULT => -1,
            _ => self.priority[number as usize] as i16,
        }
    }

    /// Group priority of a priority register, without the sub-priority.
    #[must_use]
    pub const fn group_of(&self, priority: u8) -> u8 {
        priority & (0xFE_u16 << self.group) as u8
    }

    /// The group priority of an exception.
    #[must_use]
    pub fn priority_of(&self, number: u16) -> i16 {
        let full = self.full_priority(number);
        u8::try_from(full).map_or(full, |full| i16::from(self.group_of(full)))
    }

    /// Priority of the running code, masks ignored.
    #[must_use]
    pub fn active_priority(&self) -> i16 {
        self.active.iter().map(|&number| self.priority_of(number)).min().unwrap_or(THREAD)
    }

    /// Marks an exception active.
    pub fn begin(&mut self, number: u16) {
        self.pending[usize::from(number)] = false;
        self.active.push(number);
        self.update();
    }

    /// Ends an exception. Returns whether it was active.
    pub fn end(&mut self, number: u16) -> bool {
        let Some(index) = self.active.iter().rposition(|&active| active == number) else {
            return false;
        };
        self.active.remove(index);
        if let Some(line) = number.checked_sub(exception::INTERRUPT)
            && self.is_high(line)
        {
            // A line that is still high becomes pending again.
            self.pend(number);
        }
        true
    }

    /// Makes an exception pending.
    pub fn pend(&mut self, number: u16) {
        if let Some(pending) = self.pending.get_mut(usize::from(number))
            && !*pending
        {
            *pending = true;
            self.update();
        }
    }

    /// Clears a pending exception; an interrupt whose line is high stays pending.
    pub fn unpend(&mut self, number: u16) {
        let line = number.checked_sub(exception::INTERRUPT);
        let high = line.is_some_and(|line| self.is_high(line));
        self.pending[usize::from(number)] = high;
        self.update();
    }

    /// Whether an exception is pending.
    #[must_use]
    pub const fn is_pending(&self, number: u16) -> bool {
        self.pending[number as usize]
    }

    /// Enables or disables one of the configurable faults.
    pub fn enable(&mut self, number: u16, enabled: bool) {
        self.enabled[usize::from(number)] = enabled;
        self.update();
    }

    /// Whether an exception may be taken.
    #[must_use]
    pub const fn is_enabled(&self, number: u16) -> bool {
        self.enabled[number as usize]
    }

    /// Returns whether a peripheral's interrupt line is high.
    const fn is_high(&self, interrupt: u16) -> bool {
        self.lines >> interrupt & 1 != 0
    }

    /// Sets the levels of all interrupt lines, one bit each.
    pub fn set_lines(&mut self, levels: u128) {
        let mut rising = levels & !self.lines;
        self.lines = levels;
        while rising != 0 {
            let number = exception::INTERRUPT + rising.trailing_zeros() as u16;
            rising &= rising - 1;
            if !self.active.contains(&number) {
                self.pend(number);
            }
        }
    }

    /// Sets `PRIGROUP`.
    pub fn set_group(&mut self, group: u8) {
        self.group = group & 7;
        self.update();
    }

    /// Sets the priority register of an exception.
    fn set_priority_register(&mut self, number: usize, priority: u8) {
        if let Some(slot) = self.priority.get_mut(number) {
            *slot = priority & PRIORITY_BITS;
            self.update();
        }
    }

    /// Sets the priorities of four exceptions starting at `first`; `mask` covers the bytes written.
    pub fn write_priority_registers(&mut self, first: usize, value: u32, mask: u32) {
        let bytes = value.to_le_bytes().into_iter().zip(mask.to_le_bytes());
        for (number, (byte, mask)) in (first..).zip(bytes) {
            if mask != 0 {
                self.set_priority_register(number, byte);
            }
        }
    }

    /// Writes a word of the register block at `0xE000_E100`; `mask` covers the bytes written.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32) {
        let first = 16 + (offset & 0x7F) as usize * 8;
        let numbers = (0..32)
            .filter(|bit| value & mask & 1 << bit != 0)
            .map(|bit| first + bit)
            .filter(|&number| number < EXCEPTIONS);
        match offset {
            0x000..0x080 => numbers.for_each(|number| self.enabled[number] = true),
            0x080..0x100 => numbers.for_each(|number| self.enabled[number] = false),
            0x100..0x180 => numbers.for_each(|number| self.pending[number] = true),
            0x180..0x200 => numbers.for_each(|number| self.unpend(number as u16)),
            0x300..0x3F0 => {
                self.write_priority_registers(16 + (offset - 0x300) as usize, value, mask);
            }
            _ => {}
        }
        self.update();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lowest_priority_value_then_lowest_number_goes_first() {
        let mut nvic = Nvic::default();
        nvic.write(0x000, 0b111_0000, !0);
        nvic.set_priority_register(16 + 6, 0x10);
        nvic.set_priority_register(16 + 4, 0x20);
        nvic.set_priority_register(16 + 5, 0x20);
        nvic.write(0x100, 0b011_0000, !0);
        assert_eq!(nvic.next, Some((16 + 4, 0x20)));
        nvic.pend(16 + 6);
        assert_eq!(nvic.next, Some((16 + 6, 0x10)));
    }

    #[test]
    fn a_high_line_pends_again_after_its_handler() {
        let mut nvic = Nvic::default();
        nvic.write(0x000, 1 << 7, !0);
        nvic.set_lines(1 << 7);
        nvic.begin(16 + 7);
        assert_eq!(nvic.next, None);
        nvic.end(16 + 7);
        assert_eq!(nvic.next, Some((16 + 7, 0)));
        nvic.set_lines(0);
        nvic.unpend(16 + 7);
        assert_eq!(nvic.next, None);
    }
}
