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

    /// Gives a node a name, which makes it a foot.
    pub fn call(&mut self, node: NodeId, name: &Name) {
        self.names.insert(node.get(), Some(Arc::clone(&name.0)));
    }

    /// Makes sure that no two feet have one name: in a table they would be one.
    ///
    /// # Errors
    /// Two have.
    pub fn check(&self) -> Result<(), SameName> {
        let named = |(id, name): (&u8, &Option<Arc<str>>)| Some((*id, name.clone()?));
        let feet: Vec<(u8, Arc<str>)> = self.names.iter().filter_map(named).collect();
        for (k, (other, name)) in feet.iter().enumerate() {
            if let Some((one, _)) = feet[..k].iter().find(|(_, before)| before == name) {
                return Err(SameName {
                    name: name.to_string(),
                    nodes: [*one, *other],
                });
            }
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

/// Two feet with one name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "nodes {} and {} would both be called {name}: --names {}=… gives one of them another name",
    nodes[0],
    nodes[1],
    nodes[0]
)]
pub struct SameName {
    /// The name.
    pub name: String,
    /// The ids of the nodes.
    pub nodes: [u8; 2],
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

    #[test]
    fn two_feet_with_one_name_are_refused_and_two_that_swap_theirs_are_not() {
        let mut feet = Feet::default();
        feet.call(node(33), &Name::new("FL").unwrap());
        let said = feet.check().unwrap_err().to_string();
        assert_eq!(
            said,
            "nodes 17 and 33 would both be called FL: --names 17=… gives one of them another name"
        );
        let mut feet = Feet::default();
        feet.call(node(0x11), &Name::new("FR").unwrap());
        feet.call(node(0x12), &Name::new("FL").unwrap());
        feet.add(node(40));
        feet.add(node(41));
        assert_eq!(feet.check(), Ok(()));
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
        feet.call(node(33), &Name::new("toe_1").unwrap());
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
