//! Short numbers for messages, of any magnitude.

/// Formats a number with the fewest digits that read back the same, and with an exponent where zeros would fill
/// the line.
#[must_use]
pub fn shown(value: f32) -> String {
    match value.abs() {
        0.0 | 1.0e-3..1.0e7 => value.to_string(),
        size if size.is_finite() => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// Formats a rate in Hz with about three digits, the precision of a measured one.
#[must_use]
pub fn shown_rate(value: f64) -> String {
    match value {
        0.1..1.0e7 => format!("{value:.2}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_do_not_fill_a_line() {
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
