//! Which foot a board is: a new one is the front left, as all new ones are.

use thiserror::Error;
use wire::dictionary::index;
use wire::{Address, Foot, Value};

use super::client::{Client, RequestError};
use super::settings::{self, Lasting, SettingsError, Values};

/// Why a board cannot be made another foot.
#[derive(Debug, Error)]
pub enum PositionError {
    /// The board did not take it.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A request came to nothing.
    #[error(transparent)]
    Request(#[from] RequestError),
}

/// Makes the board this foot, with the node id of that foot, stores it, and starts the board again as
/// what it is now.
///
/// # Errors
/// Other boards are in the way, or the board does not take it.
pub fn set(client: &mut Client, foot: Foot) -> Result<(), PositionError> {
    client.is_alone()?;
    let node = foot.default_node_id();
    client.is_free(node)?;
    let values = Values::from([
        (Address::new(index::FOOT, 0), Value::U8(foot.code())),
        // 0: the id of the foot.
        (Address::new(index::NODE_ID, 0), Value::U8(0)),
    ]);
    settings::write(client, &values, Lasting::Stored)?;
    client.restart(Some(node))?;
    Ok(())
}
