//! Specimens of the chip: from one end to the other of the ranges in the data sheets.
//!
//! The times of flash are the typical and maximum times in DS8626, tables 42 and 43. The data sheet gives no minimum, so
//! the fast corner takes half of the typical time, also for the start of the oscillators. If no maximum is
//! given, the slow corner takes twice the typical time.

samples::named! {
    /// Speed of the chip's internal operations and oscillators.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Corner {
        /// Oscillators at the upper limit, times at the lower.
        Fast = "fast",
        /// Typical values of the data sheets.
        #[default]
        Typical = "typical",
        /// Oscillators at the lower limit, times at the upper.
        Slow = "slow",
    } or |name| format!("{name} is not one of fast, typical, slow")
}

impl Corner {
    const fn pick(self, [fast, typical, slow]: [u32; 3]) -> u32 {
        match self {
            Self::Fast => fast,
            Self::Typical => typical,
            Self::Slow => slow,
        }
    }

    /// The low-speed oscillator of the watchdog, hertz (table 36: 17 to 47 kHz).
    #[must_use]
    pub const fn lsi_hz(self) -> u32 {
        self.pick([47_000, 32_000, 17_000])
    }

    /// The internal oscillator, hertz: ± 4 % from −10 to 85 °C (table 35).
    #[must_use]
    pub const fn hsi_hz(self) -> u32 {
        self.pick([16_640_000, 16_000_000, 15_360_000])
    }

    /// Time from enable until the crystal oscillates, µs; typical 2 ms (table 33).
    #[must_use]
    pub const fn crystal_start_us(self) -> u32 {
        self.pick([1_000, 2_000, 4_000])
    }

    /// Time until the PLL is locked, µs (table 38: 75 to 300 µs).
    #[must_use]
    pub const fn pll_lock_us(self) -> u32 {
        self.pick([75, 200, 300])
    }

    /// Time until the low-speed oscillator runs, µs (table 36: 15 typically, 40 at most).
    #[must_use]
    pub const fn lsi_start_us(self) -> u32 {
        self.pick([8, 15, 40])
    }

    /// Time to program up to a word of flash, µs, at any width (table 42).
    #[must_use]
    pub const fn program_us(self) -> u32 {
        self.pick([8, 16, 100])
    }

    /// Time to erase a sector of `kib` KiB at a parallelism of 8, 16 or 32 bits (`PSIZE` 0 to 2), ms (table 42).
    #[must_use]
    pub const fn erase_ms(self, kib: u32, psize: u32) -> u32 {
        let (typical, slow) = match (kib, psize) {
            (16, 0) => (400, 800),
            (16, 1) => (300, 600),
            (16, _) => (250, 500),
            (64, 0) => (1_200, 2_400),
            (64, 1) => (700, 1_400),
            (64, _) => (550, 1_100),
            (_, 0) => (2_000, 4_000),
            (_, 1) => (1_300, 2_600),
            (_, _) => (1_000, 2_000),
        };
        self.pick([typical / 2, typical, slow])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slow_corner_has_longer_times_and_slower_oscillators() {
        for pair in Corner::ALL.windows(2) {
            let [faster, slower] = pair else { return };
            assert!(faster.lsi_hz() > slower.lsi_hz());
            assert!(faster.hsi_hz() > slower.hsi_hz());
            assert!(faster.program_us() < slower.program_us());
            for kib in [16, 64, 128] {
                for psize in 0..3 {
                    let erase = |corner: Corner| corner.erase_ms(kib, psize);
                    assert!(erase(*faster) < erase(*slower));
                    assert!(psize == 0 || erase(*slower) < slower.erase_ms(kib, psize - 1));
                }
            }
        }
    }

    #[test]
    fn a_corner_has_a_name() {
        for corner in Corner::ALL {
            assert_eq!(corner.name().parse(), Ok(corner));
        }
        assert!("round".parse::<Corner>().is_err());
    }
}
