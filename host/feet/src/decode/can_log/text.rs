//! Parsing of times and bytes in logs.

use estimator_core::Timestamp;
use wire::CanFrame;

use super::{LogContent, Other};

/// Parses seconds with one to nine decimals, rounded to microseconds.
pub(super) fn seconds(text: &str) -> Option<Timestamp> {
    let (whole, fraction) = text.split_once('.')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if fraction.len() > 9 || !digits(whole) || !digits(fraction) {
        return None;
    }
    let nanos: u64 = format!("{fraction:0<9}").parse().ok()?;
    let whole: u64 = whole.parse().ok()?;
    let micros = whole.checked_mul(1_000_000)?;
    let micros = micros.checked_add((nanos + 500) / 1000)?;
    Some(Timestamp::from_micros(micros))
}

/// Parses `length` hexadecimal bytes, one per word; `None` for fewer. A byte must have two digits, so that a truncated
/// one is rejected.
pub(super) fn bytes<'a>(words: impl Iterator<Item = &'a str>, length: usize) -> Option<Vec<u8>> {
    let byte = |word: &str| {
        let is_byte = word.len() == 2 && word.bytes().all(|b| b.is_ascii_hexdigit());
        u8::from_str_radix(word, 16).ok().filter(|_| is_byte)
    };
    let bytes: Vec<u8> = words.take(length).map(byte).collect::<Option<_>>()?;
    (bytes.len() == length).then_some(bytes)
}

/// Identifier of a frame, as far as feet use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Identifier {
    /// 11 bits.
    Standard(u16),
    /// Extended or error frame, which no foot sends.
    Other(Other),
}

impl Identifier {
    /// Returns `None` if `id` has too many bits.
    pub(super) fn new(id: u32, is_extended: bool) -> Option<Self> {
        match (is_extended, id) {
            (false, 0..=0x7FF) => Some(Self::Standard(id as u16)),
            (true, 0..=0x1FFF_FFFF) => Some(Self::Other(Other::Extended)),
            _ => None,
        }
    }

    /// A classic data frame with this identifier; `None` for more than eight bytes.
    pub(super) fn frame<'a>(self, interface: &'a str, data: &[u8]) -> Option<LogContent<'a>> {
        match self {
            Self::Standard(id) => Some(LogContent::Frame(interface, CanFrame::new(id, data)?)),
            Self::Other(other) => (data.len() <= 8).then_some(LogContent::Other(other)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_rounded_to_microseconds() {
        for (text, micros) in [
            ("0.0", Some(0)),
            ("1.5", Some(1_500_000)),
            ("0.0014", Some(1_400)),
            ("0.0000015", Some(2)),
            ("0.9999995", Some(1_000_000)),
            ("0.9999994", Some(999_999)),
            ("1609459200.000111222", Some(1_609_459_200_000_111)),
            ("1", None),
            ("1.", None),
            (".1", None),
            ("-1.0", None),
            ("+1.0", None),
            ("1.0000000001", None),
            ("99999999999999999999.0", None),
            ("18446744073709.999999", None),
        ] {
            assert_eq!(seconds(text).map(Timestamp::as_micros), micros, "{text}");
        }
    }
}
