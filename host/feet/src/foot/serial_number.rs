//! Search for feet by their serial numbers, which stay with the boards when node ids change.

use wire::NodeId;

use super::client::{Client, RequestError};

/// Returns the feet with these serial numbers (object 0x1018:4), in their order and each once, among the nodes of a
/// bus or the one foot of a serial line, which is `None`.
///
/// # Errors
/// No foot has one of the numbers, or the line does not work.
pub fn find(
    client: &mut Client,
    feet: &[Option<NodeId>],
    wanted: &[u32],
) -> Result<Vec<Option<NodeId>>, RequestError> {
    let mut heard = Vec::new();
    for foot in feet {
        if let Some(node) = foot {
            client.follow(*node);
        }
        match client.serial_number() {
            Ok(serial) => heard.push((serial, *foot)),
            // It may be another one than those that are wanted.
            Err(RequestError::NoAnswer { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    let mut found = Vec::new();
    for number in wanted {
        let foot = heard.iter().find(|(serial, _)| serial == number);
        let (_, foot) = foot.ok_or_else(|| missing(*number, &heard))?;
        if !found.contains(foot) {
            found.push(*foot);
        }
    }
    Ok(found)
}

fn missing(wanted: u32, heard: &[(u32, Option<NodeId>)]) -> RequestError {
    let heard = heard.iter().map(|(serial, node)| match node {
        Some(node) => format!("0x{serial:08X} (node {})", node.get()),
        None => format!("0x{serial:08X}"),
    });
    let heard = match &heard.collect::<Vec<String>>()[..] {
        [] => "none".to_owned(),
        heard => heard.join(", "),
    };
    RequestError::NoSerial { wanted, heard }
}
