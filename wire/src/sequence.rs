//! Detection of missing frames by their sequence numbers.

/// Maximum distance of an overtaken UART frame behind the newest sequence number: a foot sends a
/// contact before answers and raw samples that have waited for longer.
const OVERTAKEN: u16 = 64;

/// Position of a UART frame's sequence number relative to the newest number so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Newer; this many numbers between the two are missing so far.
    Missing(u16),
    /// One of the numbers missing so far.
    Late,
    /// The sender has restarted.
    Restart,
}

/// Step from the newest 16-bit number to the received `next`.
#[must_use]
pub const fn step_u16(newest: u16, next: u16) -> Step {
    let missing = next.wrapping_sub(newest).wrapping_sub(1);
    let back = newest.wrapping_sub(next);
    if missing < 1 << 15 {
        Step::Missing(missing)
    } else if 0 < back && back <= OVERTAKEN {
        Step::Late
    } else {
        Step::Restart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_numbers_miss_nothing_across_the_wrap() {
        for (newest, next, step) in [
            (7, 8, Step::Missing(0)),
            (u16::MAX, 0, Step::Missing(0)),
            (7, 10, Step::Missing(2)),
            (65_534, 1, Step::Missing(2)),
            (0, 1 << 15, Step::Missing(32_767)),
            (0, (1 << 15) + 1, Step::Restart),
            (500, 0, Step::Restart),
            (7, 7, Step::Restart),
        ] {
            assert_eq!(step_u16(newest, next), step, "{newest}, {next}");
        }
    }

    #[test]
    fn near_numbers_are_late_and_distant_ones_a_restart() {
        assert_eq!(step_u16(100, 99), Step::Late);
        assert_eq!(step_u16(3, 65_535), Step::Late);
        assert_eq!(step_u16(100, 100 - OVERTAKEN), Step::Late);
        assert_eq!(step_u16(100, 99 - OVERTAKEN), Step::Restart);
    }
}
