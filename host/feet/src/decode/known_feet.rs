//! Nodes of a CAN bus that are feet; names of feet by node and by line.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use thiserror::Error;
use wire::{Foot, NodeId};

use crate::usb;

/// Nodes that are feet, with their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnownFeet {
    /// Nodes that are feet, by id, each with its name if it has one.
    names: BTreeMap<u8, Option<Arc<str>>>,
    /// Names by line: a port, a file, or the serial number of a board on USB.
    lines: BTreeMap<String, Arc<str>>,
}

impl Default for KnownFeet {
    /// The feet of [`wire::Foot`] with their default ids: 0x11 is `FL`, 0x12 `FR`, 0x13 `RL`, 0x14 `RR`,
    /// 0x15 `L`, 0x16 `R`.
    fn default() -> Self {
        let name = |foot: Foot| (foot.default_node_id().get(), Some(foot.name().into()));
        Self { names: Foot::ALL.into_iter().map(name).collect(), lines: BTreeMap::new() }
    }
}

impl KnownFeet {
    /// Adds a node that is a foot; an existing name is kept.
    pub fn add(&mut self, node: NodeId) {
        self.names.entry(node.get()).or_default();
    }

    /// Gives feet names. A node that gets a name becomes a foot. Another node that has the name by default loses it,
    /// because both would be the same foot in a table.
    ///
    /// # Errors
    /// A foot is given two names, or two feet the same name. No foot is named then.
    pub fn give_names(&mut self, names: &[(NamedFoot, Name)]) -> Result<(), NamedTwice> {
        for (k, (foot, name)) in names.iter().enumerate() {
            let before = &names[..k];
            if before.iter().any(|(other, _)| other == foot) {
                return Err(NamedTwice::Foot(foot.clone()));
            }
            if before.iter().any(|(_, other)| other == name) {
                return Err(NamedTwice::Name(name.clone()));
            }
        }
        // All names are taken before one is given, so that two nodes can swap theirs.
        names.iter().for_each(|(_, name)| self.take_name(name));
        for (foot, name) in names {
            let name = Arc::clone(&name.0);
            match foot {
                NamedFoot::Node(node) => {
                    self.names.insert(node.get(), Some(name));
                }
                NamedFoot::Line(line) => {
                    self.lines.insert(line.clone(), name);
                }
            }
        }
        Ok(())
    }

    /// Takes a name from the node that has it, if any. The node remains a foot.
    fn take_name(&mut self, name: &Name) {
        for known in self.names.values_mut() {
            if known.as_deref() == Some(&*name.0) {
                *known = None;
            }
        }
    }

    /// Name given to the foot of a line, if any.
    #[must_use]
    pub fn name_of_line(&self, line: &str) -> Option<Arc<str>> {
        let mut lines = self.lines.iter();
        lines.find(|(of, _)| names_line(of, line)).map(|(_, name)| Arc::clone(name))
    }

    /// Returns whether a node is a foot.
    #[must_use]
    pub fn contains(&self, node: NodeId) -> bool {
        self.names.contains_key(&node.get())
    }

    /// Name of a foot, if any.
    #[must_use]
    pub fn name(&self, node: NodeId) -> Option<Arc<str>> {
        self.names.get(&node.get()).cloned().flatten()
    }

    /// Formats the ids: `17 to 22, 33`.
    pub(super) fn ids(&self) -> String {
        let mut ranges: Vec<(u8, u8)> = Vec::new();
        for &id in self.names.keys() {
            match ranges.last_mut() {
                Some((_, last)) if last.checked_add(1) == Some(id) => *last = id,
                _ => ranges.push((id, id)),
            }
        }
        let text = |(first, last): (u8, u8)| {
            if first == last { first.to_string() } else { format!("{first} to {last}") }
        };
        ranges.into_iter().map(text).collect::<Vec<_>>().join(", ")
    }
}

/// Foot that is given a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NamedFoot {
    /// A node of a bus.
    Node(NodeId),
    /// The foot of a serial line, by the line's port or by the serial number of its board on USB: [`names_line`].
    Line(String),
}

impl fmt::Display for NamedFoot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(node) => write!(f, "node {}", node.get()),
            Self::Line(line) => f.write_str(line),
        }
    }
}

/// Returns whether `of` names a serial line: its port or file, the last part of that path, or the serial number of its
/// board on USB.
#[must_use]
pub fn names_line(of: &str, line: &str) -> bool {
    of == line
        || Path::new(line).file_name().is_some_and(|name| name == of)
        || usb::serial_number(line).is_some_and(|serial| usb::is_serial_number(of, &serial))
}

/// Conflicting names.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NamedTwice {
    /// A foot is given two names.
    #[error("{0} is given two names")]
    Foot(NamedFoot),
    /// Two feet are given the same name.
    #[error("two feet are given the name {0}")]
    Name(Name),
}

/// Name of a foot, valid in tables.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(Arc<str>);

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The text is not a valid name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the name of a foot has 1 to 32 letters, digits, hyphens and underscores")]
pub struct NotAName;

impl Name {
    /// Maximum length, bytes.
    const LONGEST: usize = 32;

    /// Creates a name.
    ///
    /// # Errors
    /// The text is not 1 to 32 ASCII letters, digits, hyphens and underscores.
    pub fn new(text: &str) -> Result<Self, NotAName> {
        let allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
        if (1..=Self::LONGEST).contains(&text.len()) && text.bytes().all(allowed) {
            Ok(Self(text.into()))
        } else {
            Err(NotAName)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(id: u8) -> NodeId {
        NodeId::new(id).unwrap()
    }

    fn name(text: &str) -> Name {
        Name::new(text).unwrap()
    }

    /// Names of nodes and of lines, as on a command line.
    fn names<const N: usize>(names: [(&str, &str); N]) -> Vec<(NamedFoot, Name)> {
        let foot = |of: &str| match of.parse() {
            Ok(id) => NamedFoot::Node(node(id)),
            Err(_) => NamedFoot::Line(of.to_owned()),
        };
        names.map(|(of, text)| (foot(of), name(text))).into()
    }

    #[test]
    fn foot_with_two_names_is_refused() {
        for of in ["33", "ttyACM0"] {
            let mut feet = KnownFeet::default();
            let twice = names([(of, "A"), ("34", "B"), (of, "C")]);
            assert_eq!(feet.give_names(&twice), Err(NamedTwice::Foot(twice[0].0.clone())));
            assert_eq!(feet, KnownFeet::default());
        }
    }

    #[test]
    fn name_of_two_feet_is_refused() {
        for [one, other] in [["33", "34"], ["ttyACM0", "ttyACM1"], ["33", "ttyACM0"]] {
            let mut feet = KnownFeet::default();
            let twice = names([(one, "A"), (other, "A")]);
            assert_eq!(feet.give_names(&twice), Err(NamedTwice::Name(name("A"))));
            assert_eq!(feet, KnownFeet::default());
        }
    }

    #[test]
    fn given_name_is_taken_from_the_node_of_that_default() {
        for of in ["33", "ttyACM0"] {
            let mut feet = KnownFeet::default();
            feet.give_names(&names([(of, "FL")])).unwrap();
            assert!(feet.contains(node(0x11)) && feet.name(node(0x11)).is_none());
        }
        let mut feet = KnownFeet::default();
        feet.give_names(&names([("17", "FR"), ("18", "FL")])).unwrap();
        assert_eq!(feet.name(node(0x11)).as_deref(), Some("FR"));
        assert_eq!(feet.name(node(0x12)).as_deref(), Some("FL"));
    }

    #[test]
    fn line_is_named_by_its_path_or_the_last_part_of_it() {
        let mut feet = KnownFeet::default();
        feet.give_names(&names([("ttyACM0", "FR"), ("/dev/ttyACM1", "RL")])).unwrap();
        let name_of = |line: &str| feet.name_of_line(line).map(|name| name.to_string());
        assert_eq!(name_of("/dev/ttyACM0").as_deref(), Some("FR"));
        assert_eq!(name_of("ttyACM0").as_deref(), Some("FR"));
        assert_eq!(name_of("/dev/ttyACM1").as_deref(), Some("RL"));
        for other in ["ttyACM1", "/dev/ttyACM01", "/ttyACM0/x"] {
            assert_eq!(name_of(other), None, "{other}");
        }
    }

    #[test]
    fn feet_have_default_names_until_renamed() {
        let mut feet = KnownFeet::default();
        assert_eq!(feet.name(node(0x11)).as_deref(), Some("FL"));
        assert_eq!(feet.name(node(0x16)).as_deref(), Some("R"));
        assert_eq!(feet.ids(), "17 to 22");
        assert!(!feet.contains(node(33)));
        feet.add(node(33));
        assert!(feet.contains(node(33)) && feet.name(node(33)).is_none());
        feet.give_names(&names([("33", "toe_1")])).unwrap();
        feet.add(node(33));
        assert_eq!(feet.name(node(33)).as_deref(), Some("toe_1"));
        assert_eq!(feet.ids(), "17 to 22, 33");
    }

    #[test]
    fn names_that_do_not_fit_a_table_cell_are_rejected() {
        let long = "x".repeat(33);
        for text in ["", "a,b", "a b", "\"", "ä", "a\nb", &long] {
            assert_eq!(Name::new(text), Err(NotAName), "{text:?}");
        }
        assert!(Name::new(&long[..32]).is_ok());
    }
}
