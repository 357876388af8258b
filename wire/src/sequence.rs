//! What the sequence numbers of frames say is missing.

/// How many numbers of 16 bits are missing between a UART frame and the `next` that came. None where
/// the step is not forwards: the sender has started anew.
#[must_use]
pub const fn missing_u16(last: u16, next: u16) -> u16 {
    let missing = next.wrapping_sub(last).wrapping_sub(1);
    if missing < 1 << 15 { missing } else { 0 }
}

/// How many numbers of 8 bits are missing between a TPDO1 and the `next` that came, modulo 2⁸: that
/// of a foot started anew cannot be told from a gap.
#[must_use]
pub const fn missing_u8(last: u8, next: u8) -> u8 {
    next.wrapping_sub(last).wrapping_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_number_misses_none_and_the_wrap_is_no_gap() {
        assert_eq!((missing_u16(7, 8), missing_u16(u16::MAX, 0)), (0, 0));
        assert_eq!((missing_u16(7, 10), missing_u16(65_534, 1)), (2, 2));
        assert_eq!((missing_u16(500, 0), missing_u16(7, 7)), (0, 0));
        assert_eq!(
            (missing_u16(0, 1 << 15), missing_u16(0, (1 << 15) + 1)),
            (32_767, 0)
        );
        assert_eq!(
            (missing_u8(7, 8), missing_u8(255, 2), missing_u8(7, 7)),
            (0, 2, 255)
        );
    }
}
