//! Lists of names in errors.

use std::fmt::Display;

/// Lists up to twenty topics or other names, or says that there is nothing.
pub(crate) fn listed<T: Display>(names: &[T]) -> String {
    match names {
        [] => "nothing".to_owned(),
        _ => first_of(names, 20),
    }
}

/// Joins the first names with commas, and counts the rest.
#[must_use]
pub fn first_of<T: Display>(names: impl IntoIterator<Item = T>, shown: usize) -> String {
    let mut names = names.into_iter();
    let first: Vec<_> = names.by_ref().take(shown).map(|name| name.to_string()).collect();
    match names.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}
