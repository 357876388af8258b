//! Our names of the columns of a table.

use estimator_core::Axis;

/// Our names other than axes.
pub(crate) const OTHERS: [&str; 5] = ["t", "force", "label", "validity", "foot"];

/// Our name that equals this one.
pub(crate) fn own_name(name: &str) -> Option<&'static str> {
    let axes = Axis::ALL.map(Axis::name);
    axes.into_iter().chain(OTHERS).find(|ours| *ours == name)
}

/// Returns whether a column of a `csv` may have this name.
#[must_use]
pub fn is_ours(name: &str) -> bool {
    own_name(name).is_some()
}

/// Returns whether this is the name of an axis.
#[must_use]
pub fn is_axis(name: &str) -> bool {
    Axis::ALL.iter().any(|axis| axis.name() == name)
}
