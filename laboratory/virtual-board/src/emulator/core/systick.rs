//! The system timer: counts down from its reload value at the core's clock or an eighth of it.

use crate::emulator::time::NEVER;

/// The timer.
#[derive(Clone, Debug, Default)]
pub struct SysTick {
    control: u32,
    reload: u32,
    /// Time at which the counter last held `from`.
    since: u64,
    from: u32,
    count_flag: bool,
    period: u64,
}

impl SysTick {
    const ENABLE: u32 = 1;
    const INTERRUPT: u32 = 2;
    const CORE_CLOCK: u32 = 4;
    const COUNT: u32 = 1 << 16;

    /// Creates the state after a reset at `now`, with the period of the core's clock.
    #[must_use]
    pub fn new(now: u64, period: u64) -> Self {
        Self { since: now, period, ..Self::default() }
    }

    const fn step(&self) -> u64 {
        match self.control & Self::CORE_CLOCK {
            0 => self.period * 8,
            _ => self.period,
        }
    }

    /// Changes the period of the core's clock at `now`.
    pub fn set_period(&mut self, now: u64, period: u64) {
        self.from = self.value(now);
        self.since = now;
        self.period = period;
    }

    fn value(&self, now: u64) -> u32 {
        if self.control & Self::ENABLE == 0 || self.period == 0 {
            return self.from;
        }
        let steps = (now - self.since) / self.step();
        let from = u64::from(self.from);
        if steps <= from {
            (from - steps) as u32
        } else {
            let round = u64::from(self.reload) + 1;
            // From zero the next step takes the reload value.
            (u64::from(self.reload) - (steps - from - 1) % round) as u32
        }
    }

    /// Time at which the counter next reaches zero.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        if self.control & Self::ENABLE == 0 || self.period == 0 || (self.from | self.reload) == 0 {
            return NEVER;
        }
        let steps = match self.from {
            0 => u64::from(self.reload) + 1,
            from => u64::from(from),
        };
        self.since + steps * self.step()
    }

    /// Advances to `now`. Returns whether the exception becomes pending.
    pub fn advance(&mut self, now: u64) -> bool {
        let mut pend = false;
        while self.next_event() <= now {
            self.since = self.next_event();
            self.from = 0;
            self.count_flag = true;
            pend |= self.control & Self::INTERRUPT != 0;
        }
        pend
    }

    /// Reads a register at an offset from `0xE000_E010`.
    pub fn read(&mut self, offset: u32, now: u64) -> u32 {
        match offset {
            0 => {
                let flag = core::mem::take(&mut self.count_flag);
                self.control | if flag { Self::COUNT } else { 0 }
            }
            4 => self.reload,
            8 => self.value(now),
            // TENMS is unknown.
            _ => 0xC000_0000,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        self.from = self.value(now);
        self.since = now;
        match offset {
            0 => self.control = value & 7,
            4 => self.reload = value & 0x00FF_FFFF,
            8 => {
                self.from = 0;
                self.count_flag = false;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reaches_zero_once_every_reload_plus_one_cycles() {
        let mut timer = SysTick::new(0, 10);
        timer.write(4, 99, 0);
        timer.write(8, 0, 0);
        timer.write(0, 7, 0);
        assert_eq!(timer.next_event(), 1000);
        assert_eq!(timer.read(8, 10), 99);
        assert_eq!(timer.read(8, 990), 1);
        assert!(timer.advance(1000));
        assert_eq!(timer.next_event(), 2000);
        assert_eq!(timer.read(0, 1000), 0x1_0007);
        assert_eq!(timer.read(0, 1000), 7);
    }
}
