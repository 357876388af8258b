//! Mapping of columns of a file to ours: `ax=linear_acceleration.x,…`.

use std::fmt;
use std::str::FromStr;

use estimator_core::Axis;

/// Our names other than axes.
const OTHERS: [&str; 4] = ["t", "force", "label", "validity"];

/// Our name that equals this one.
fn own_name(name: &str) -> Option<&'static str> {
    let axes = Axis::ALL.map(Axis::name);
    axes.into_iter().chain(OTHERS).find(|ours| *ours == name)
}

/// Returns whether a column of a `csv` may have this name.
pub(in crate::input) fn is_ours(name: &str) -> bool {
    own_name(name).is_some()
}

/// Returns whether this is the name of an axis.
pub(in crate::input) fn is_axis(name: &str) -> bool {
    Axis::ALL.iter().any(|axis| axis.name() == name)
}

/// Columns of a file by our names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// Pairs of our name and that of the file.
    pub(super) columns: Vec<(&'static str, String)>,
}

impl Mapping {
    /// Pairs of our name and that of the file.
    pub fn pairs(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.columns.iter().map(|(ours, theirs)| (*ours, theirs.as_str()))
    }

    /// Returns whether the mapping is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }
}

impl FromStr for Mapping {
    type Err = String;

    /// Reads `ours=theirs` pairs, separated by commas.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut columns: Vec<(&'static str, String)> = Vec::new();
        for pair in text.split(',') {
            let Some((ours, theirs)) = pair.split_once('=') else {
                return Err(format!(
                    "{pair:?} is not a pair: write OURS=THEIRS, such as ax=linear_acceleration.x"
                ));
            };
            let (ours, theirs) = (ours.trim(), theirs.trim());
            let ours = own_name(ours).ok_or_else(|| {
                let axes = Axis::ALL.map(Axis::name).join(", ");
                format!(
                    "there is no column {ours:?} to map to; there are {axes}, {}",
                    OTHERS.join(", ")
                )
            })?;
            if columns.iter().any(|(named, _)| *named == ours) {
                return Err(format!("{ours} is mapped twice"));
            }
            if columns.iter().any(|(_, named)| named == theirs) {
                return Err(format!("column {theirs:?} is mapped twice"));
            }
            columns.push((ours, theirs.to_owned()));
        }
        Ok(Self { columns })
    }
}

impl fmt::Display for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (ours, theirs)) in self.pairs().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            write!(f, "{comma}{ours}={theirs}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mapping_reads_as_it_is_written() {
        let text = "t=stamp,ax=/imu/linear_acceleration/x,force=foot_force[0]";
        let mapping: Mapping = text.parse().unwrap();
        assert_eq!(mapping.to_string(), text);
        assert_eq!(mapping.pairs().next(), Some(("t", "stamp")));
    }

    #[test]
    fn invalid_mapping_is_rejected() {
        for (text, why) in [
            ("ax", "is not a pair"),
            ("", "is not a pair"),
            ("a_x=foo", "there is no column \"a_x\" to map to"),
            ("ax=foo,ax=bar", "ax is mapped twice"),
            ("ax=foo,ay=foo", "column \"foo\" is mapped twice"),
        ] {
            let said = text.parse::<Mapping>().unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
