//! Virtual time, in a unit that divides the period of every clock of the board.

/// Units in a second. 8, 16, 25, 42, 80, 84, 144, 160, 168 and 180 MHz and 32 kHz all divide it.
pub const PER_SECOND: u64 = 50_400_000_000;

/// Time of an event that never occurs.
pub const NEVER: u64 = u64::MAX;

/// Units in one cycle of a clock of `hertz`.
#[must_use]
pub const fn cycle(hertz: u32) -> u64 {
    match hertz {
        0 => NEVER,
        _ => PER_SECOND / hertz as u64,
    }
}

/// Nanoseconds as units, rounded up.
#[must_use]
pub const fn from_ns(ns: u64) -> u64 {
    (ns * 252).div_ceil(5)
}

/// Units as whole nanoseconds.
#[must_use]
pub const fn to_ns(time: u64) -> u64 {
    time / 252 * 5 + time % 252 * 5 / 252
}

/// Microseconds as units.
#[must_use]
pub const fn from_us(us: u64) -> u64 {
    us * (PER_SECOND / 1_000_000)
}

/// Units as microseconds.
#[must_use]
pub fn to_us(time: u64) -> f64 {
    time as f64 / (PER_SECOND / 1_000_000) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_clock_of_the_board_divides_the_unit() {
        for megahertz in
            [1, 2, 4, 8, 12, 16, 20, 21, 24, 25, 30, 40, 42, 48, 80, 84, 120, 144, 160, 168, 180]
        {
            assert_eq!(PER_SECOND % (megahertz * 1_000_000), 0, "{megahertz} MHz");
        }
        assert_eq!(PER_SECOND % 32_000, 0);
    }

    #[test]
    fn nanoseconds_come_back_from_units() {
        for ns in [0, 1, 149, 75_000, 3_600_000_000_007] {
            assert_eq!(to_ns(from_ns(ns)), ns);
        }
    }
}
