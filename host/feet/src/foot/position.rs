//! Position of a board; a new board is the front left foot.

use wire::dictionary::index;
use wire::{Address, Foot, Value};

use super::client::Client;
use super::settings::{self, Lasting, SettingsError, Values};

/// Sets and stores the position of the board, with the default node id of that position, and restarts the
/// board.
///
/// # Errors
/// Another board has this id, or the board does not accept the settings.
pub fn set(client: &mut Client, foot: Foot) -> Result<(), SettingsError> {
    client.is_alone()?;
    let node = foot.default_node_id();
    client.is_free(node)?;
    let values = Values::from([
        (Address::new(index::FOOT, 0), Value::U8(foot.code())),
        // 0: the default id of the position.
        (Address::new(index::NODE_ID, 0), Value::U8(0)),
    ]);
    settings::write(client, &values, Lasting::Stored)?;
    client.restart(Some(node))?;
    Ok(())
}
