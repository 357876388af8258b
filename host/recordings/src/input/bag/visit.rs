//! Visit of all messages of a bag, in any storage.

use super::super::error::InputError;
use super::super::format::Format;
use super::super::open::Part;
use super::storage::Visitor;
use super::{mcap, rosbag2};

/// Passes all messages to a visitor in stored order, and reports each part that ends early.
pub(super) fn visit(
    parts: &mut [Part],
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Vec<String>, InputError> {
    let mut notices = Vec::new();
    let is_alone = parts.len() == 1;
    for part in parts {
        let name = if is_alone { file.to_owned() } else { part.path.display().to_string() };
        let early = match part.format {
            Format::Mcap => mcap::visit(part, &name, visitor)?,
            _ => rosbag2::visit(part, &name, visitor)?,
        };
        notices.extend(early.map(|why| {
            format!(
                "{name} ends early ({why}): what is there is read; for readers that refuse such a file, \
                 footfall convert writes a whole one"
            )
        }));
    }
    Ok(notices)
}
