//! Numbers in messages: short, however small or large they are.

/// A number as a person would write it: as few digits as read back the same, with an exponent
/// where zeros would fill the line.
#[must_use]
pub fn shown(value: f32) -> String {
    match value.abs() {
        0.0 | 1.0e-3..1.0e7 => value.to_string(),
        size if size.is_finite() => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// A rate in Hz to about three digits, which is what one that was measured is good for.
pub(crate) fn shown_rate(value: f64) -> String {
    match value {
        0.1..1.0e7 => format!("{value:.2}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_fills_a_line_with_zeros() {
        for (value, text) in [
            (1.0e-30, "1e-30"),
            (-0.005, "-0.005"),
            (1.0e-6, "1e-6"),
            (0.0, "0"),
            (10_000.0, "10000"),
            (1.0e9, "1e9"),
            (-1.0e30, "-1e30"),
            (f32::INFINITY, "inf"),
            (f32::NAN, "NaN"),
        ] {
            assert_eq!(shown(value), text);
        }
        assert_eq!(shown_rate(997.0), "997.00");
        assert_eq!(shown_rate(1.0e-9), "1.00e-9");
    }
}
