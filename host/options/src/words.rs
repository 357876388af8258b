//! Words for values, such as `included`.

use estimator_core::Gravity;

/// Words for whether samples contain gravity.
pub const GRAVITIES: [(&str, Gravity); 2] =
    [("included", Gravity::Included), ("removed", Gravity::Removed)];

/// Returns the word for a value in a table of words.
pub fn word_of<T: Copy + PartialEq, const N: usize>(
    table: &[(&'static str, T); N],
    value: T,
) -> &'static str {
    let mut rows = table.iter();
    rows.find_map(|(word, of)| (*of == value).then_some(*word)).unwrap_or_default()
}

/// Returns the value of a word in a table of words.
///
/// # Errors
/// A sentence with both words.
pub fn value_of<T: Copy>(table: &[(&'static str, T); 2], text: &str) -> Result<T, String> {
    let mut rows = table.iter();
    rows.find_map(|(word, value)| (*word == text).then_some(*value)).ok_or_else(|| {
        let [(one, _), (other, _)] = table;
        format!("{text:?} is neither \"{one}\" nor \"{other}\"")
    })
}
