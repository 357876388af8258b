//! Which nodes of a CAN bus are feet, and how they are called.

use std::collections::BTreeMap;
use std::sync::Arc;

use thiserror::Error;
use wire::{Foot, NodeId};

/// The nodes that are feet, with their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Feet {
    /// By node id; a foot need not have a name.
    names: BTreeMap<u8, Option<Arc<str>>>,
}

impl Default for Feet {
    /// The feet that [`wire::Foot`] has, with the ids that they have from the start: 0x11 is `FL`,
    /// 0x12 `FR`, 0x13 `RL`, 0x14 `RR`, 0x15 `L`, 0x16 `R`.
    fn default() -> Self {
        let name = |foot: Foot| (foot.default_node_id().get(), Some(foot.name().into()));
        Self {
            names: Foot::ALL.into_iter().map(name).collect(),
        }
    }
}

impl Feet {
    /// Adds a node that is a foot, without a name where it has none yet.
    pub fn add(&mut self, node: NodeId) {
        self.names.entry(node.get()).or_default();
    }

    /// Gives nodes names, which makes them feet. Another node that has one of the names from the start
    /// loses it: in a table the two would be one foot.
    ///
    /// # Errors
    /// A node gets two names, or two nodes get one.
    pub fn call(&mut self, names: &[(NodeId, Name)]) -> Result<(), NamedTwice> {
        for (k, (node, name)) in names.iter().enumerate() {
            let before = &names[..k];
            if before.iter().any(|(other, _)| other == node) {
                return Err(NamedTwice::Node(node.get()));
            }
            if before.iter().any(|(_, other)| other == name) {
                return Err(NamedTwice::Name(name.0.to_string()));
            }
        }
        for known in self.names.values_mut() {
            let is_given = |known: &str| names.iter().any(|(_, name)| *name.0 == *known);
            if known.as_deref().is_some_and(is_given) {
                *known = None;
            }
        }
        for (node, name) in names {
            self.names.insert(node.get(), Some(Arc::clone(&name.0)));
        }
        Ok(())
    }

    /// Whether a node is a foot.
    #[must_use]
    pub fn contains(&self, node: NodeId) -> bool {
        self.names.contains_key(&node.get())
    }

    /// The name of a foot.
    #[must_use]
    pub fn name(&self, node: NodeId) -> Option<Arc<str>> {
        self.names.get(&node.get()).cloned().flatten()
    }

    /// The ids as a text: `17 to 22, 33`.
    pub(super) fn ids(&self) -> String {
        let mut ranges: Vec<(u8, u8)> = Vec::new();
        for &id in self.names.keys() {
            match ranges.last_mut() {
                Some((_, last)) if last.checked_add(1) == Some(id) => *last = id,
                _ => ranges.push((id, id)),
            }
        }
        let text = |(first, last): (u8, u8)| match first == last {
            true => first.to_string(),
            false => format!("{first} to {last}"),
        };
        ranges.into_iter().map(text).collect::<Vec<_>>().join(", ")
    }
}

/// Names that contradict each other.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NamedTwice {
    /// A node gets two.
    #[error("node {0} gets two names")]
    Node(u8),
    /// Two nodes get one.
    #[error("two nodes get the name {0}")]
    Name(String),
}

/// A name of a foot: it goes into tables.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(Arc<str>);

/// A text that is no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a name of a foot is 1 to 32 letters, digits, hyphens and underscores")]
pub struct NotAName;

impl Name {
    /// The longest name, bytes.
    const LONGEST: usize = 32;

    /// A name.
    ///
    /// # Errors
    /// It is not 1 to 32 ASCII letters, digits, hyphens and underscores.
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

    #[test]
    fn no_two_feet_have_one_name() {
        let mut feet = Feet::default();
        let twice = [(node(33), name("A")), (node(34), name("A"))];
        assert_eq!(feet.call(&twice), Err(NamedTwice::Name("A".to_owned())));
        let twice = [(node(33), name("A")), (node(33), name("B"))];
        assert_eq!(feet.call(&twice), Err(NamedTwice::Node(33)));
        assert_eq!(feet, Feet::default());
        // Who is named takes the name from who has it from the start.
        feet.call(&[(node(33), name("FL"))]).unwrap();
        assert_eq!(feet.name(node(33)).as_deref(), Some("FL"));
        assert!(feet.contains(node(0x11)) && feet.name(node(0x11)).is_none());
        let mut feet = Feet::default();
        feet.call(&[(node(0x11), name("FR")), (node(0x12), name("FL"))])
            .unwrap();
        assert_eq!(feet.name(node(0x11)).as_deref(), Some("FR"));
        assert_eq!(feet.name(node(0x12)).as_deref(), Some("FL"));
    }

    #[test]
    fn feet_have_the_names_of_their_ids_until_they_get_others() {
        let mut feet = Feet::default();
        assert_eq!(feet.name(node(0x11)).as_deref(), Some("FL"));
        assert_eq!(feet.name(node(0x16)).as_deref(), Some("R"));
        assert_eq!(feet.ids(), "17 to 22");
        assert!(!feet.contains(node(33)));
        feet.add(node(33));
        assert!(feet.contains(node(33)) && feet.name(node(33)).is_none());
        feet.call(&[(node(33), name("toe_1"))]).unwrap();
        feet.add(node(33));
        assert_eq!(feet.name(node(33)).as_deref(), Some("toe_1"));
        assert_eq!(feet.ids(), "17 to 22, 33");
    }

    #[test]
    fn a_name_fits_into_a_cell_of_a_table() {
        let long = "x".repeat(33);
        for text in ["", "a,b", "a b", "\"", "ä", "a\nb", &long] {
            assert_eq!(Name::new(text), Err(NotAName), "{text:?}");
        }
        assert!(Name::new(&long[..32]).is_ok());
    }
}
