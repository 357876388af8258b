//! Columns of a file by our names.

use std::fmt;
use std::str::FromStr;

use estimator_core::Axis;

use crate::columns::own_name;
use crate::problem::OptionProblem;

/// Columns of a file by our names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// Pairs of our name and the file's name.
    pub columns: Vec<(&'static str, String)>,
}

impl Mapping {
    /// Pairs of our name and the file's name.
    pub fn pairs(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.columns.iter().map(|(ours, theirs)| (*ours, theirs.as_str()))
    }

    /// Returns how the mapping exchanges our six axes among each other, such as `wx=-wy,wy=wx`: for each axis the index of
    /// the axis that takes its place, and a sign. `None` if it names other columns.
    #[must_use]
    pub fn exchange(&self) -> Option<[(usize, f64); 6]> {
        let index_of = |name: &str| Axis::ALL.iter().position(|axis| axis.name() == name);
        let mut exchange: [(usize, f64); 6] = std::array::from_fn(|axis| (axis, 1.0));
        for (ours, theirs) in self.pairs() {
            let (sign, theirs) =
                theirs.strip_prefix('-').map_or((1.0, theirs), |theirs| (-1.0, theirs));
            exchange[index_of(ours)?] = (index_of(theirs)?, sign);
        }
        let mut taken = exchange.map(|(index, _)| index);
        taken.sort_unstable();
        (!self.is_empty() && taken == [0, 1, 2, 3, 4, 5]).then_some(exchange)
    }

    /// Returns the pairs that name columns of a file: none if the mapping [exchanges](Self::exchange) axes.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let is_exchange = self.exchange().is_some();
        self.pairs().filter(move |_| !is_exchange)
    }

    /// Returns whether the mapping is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }
}

impl FromStr for Mapping {
    type Err = OptionProblem;

    /// Reads `ours=theirs` pairs, separated by commas.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let mut columns: Vec<(&'static str, String)> = Vec::new();
        for pair in text.split(',') {
            let Some((ours, theirs)) = pair.split_once('=') else {
                return Err(OptionProblem::NotAPair(pair.to_owned()));
            };
            let (ours, theirs) = (ours.trim(), theirs.trim());
            let unknown = || OptionProblem::UnknownColumn(ours.to_owned());
            let ours = own_name(ours).ok_or_else(unknown)?;
            if columns.iter().any(|(named, _)| *named == ours) {
                return Err(OptionProblem::MappedTwice(ours));
            }
            if columns.iter().any(|(_, named)| named == theirs) {
                return Err(OptionProblem::TakenTwice(theirs.to_owned()));
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
    fn exchange_of_axes_is_a_permutation_with_signs() {
        let exchange = |text: &str| text.parse::<Mapping>().unwrap().exchange();
        let turned = exchange("wx=-wy,wy=wx").expect("an exchange");
        assert_eq!(turned[3..], [(4, -1.0), (3, 1.0), (5, 1.0)]);
        assert_eq!(exchange("wx=-wx").map(|axes| axes[3]), Some((3, -1.0)));
        for other in ["ax=wx", "ax=acc_x", "t=stamp", "wx=-gyro"] {
            assert_eq!(exchange(other), None, "{other}");
        }
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
            let said = text.parse::<Mapping>().unwrap_err().to_string();
            assert!(said.contains(why), "{said}");
        }
    }
}
