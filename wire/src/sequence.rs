//! What the sequence numbers of frames say is missing.

/// How far back the number of a UART frame may lie that others have overtaken: a foot sends a
/// contact before answers and raw samples that have waited for longer.
const OVERTAKEN: u16 = 64;

/// What the number of a UART frame says, after the newest number so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// It is newer; this many numbers between the two have not come yet.
    Missing(u16),
    /// It is one of those that had not come yet.
    Late,
    /// The sender has started again.
    Restart,
}

/// The step from the newest number of 16 bits to the `next` that came.
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

/// How many numbers of 8 bits are missing between a TPDO1 and the `next` that came, modulo 2⁸: that
/// of a foot started again cannot be distinguished from a gap.
#[must_use]
pub const fn missing_u8(last: u8, next: u8) -> u8 {
    next.wrapping_sub(last).wrapping_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_number_misses_none_and_the_wrap_is_no_gap() {
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
        assert_eq!(
            (missing_u8(7, 8), missing_u8(255, 2), missing_u8(7, 7)),
            (0, 2, 255)
        );
    }

    #[test]
    fn a_number_a_little_back_is_late_and_one_far_back_a_restart() {
        assert_eq!(step_u16(100, 99), Step::Late);
        assert_eq!(step_u16(3, 65_535), Step::Late);
        assert_eq!(step_u16(100, 100 - OVERTAKEN), Step::Late);
        assert_eq!(step_u16(100, 99 - OVERTAKEN), Step::Restart);
    }
}
