//! Nodes and names of feet, for all commands that read their output.

use clap::Args;
use feet::decode::Feet;
use feet::decode::feet::{Name, NamedTwice};
use wire::NodeId;

/// Feet beside those that have the ids of their places.
#[derive(Clone, Debug, Default, Args)]
pub struct FeetArguments {
    /// On CAN, a node that is a foot beside those of the ids 0x11 to 0x16; may be repeated
    #[arg(long = "node", value_name = "ID", value_parser = parse_node)]
    pub nodes: Vec<NodeId>,
    /// Names of feet by node id, for the column foot, such as 1=FL,2=FR; these nodes are feet
    #[arg(long, value_name = "ID=NAME,...", value_delimiter = ',', value_parser = parse_name)]
    pub names: Vec<(NodeId, Name)>,
}

impl FeetArguments {
    /// Returns the feet.
    ///
    /// # Errors
    /// A node is given two names, or two nodes are given one name.
    pub(crate) fn feet(&self) -> Result<Feet, NamedTwice> {
        let mut feet = Feet::default();
        self.nodes.iter().for_each(|node| feet.add(*node));
        feet.call(&self.names)?;
        Ok(feet)
    }
}

/// Parses a node id, decimal or hexadecimal with 0x.
pub(crate) fn parse_node(text: &str) -> Result<NodeId, &'static str> {
    let id = parse_number(text).and_then(|id| NodeId::new(u8::try_from(id).ok()?));
    id.ok_or("write a node id, 1 to 127 or 0x01 to 0x7F")
}

/// Parses a number, decimal or hexadecimal with 0x.
pub(crate) fn parse_number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Parses a node id with the name of its foot.
fn parse_name(text: &str) -> Result<(NodeId, Name), String> {
    let (id, name) = text.split_once('=').ok_or("write a node id and a name, such as 1=FL")?;
    let name = Name::new(name).map_err(|error| error.to_string())?;
    Ok((parse_node(id)?, name))
}
