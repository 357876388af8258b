//! The `SQLite` database of a rosbag2: the tables `topics` and `messages`. Source: `sqlite_storage.cpp` of
//! <https://github.com/ros2/rosbag2>.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags, ffi};
use tempfile::{NamedTempFile, TempPath};

use crate::messages::{Channel, MessageTimes, Schema, Visitor};
use files::file_kind::FileKind;
use stored::container::ContainerFile;
use stored::error::{InputError, Problem};

/// Advice in the error about a file that is damaged rather than truncated.
const ADVICE: &str = "sqlite3 walk.db3 \".recover\" saves what can be";

/// Columns of the table `topics` that not every bag has, and their names in MCAP. Source: `mcap_storage.cpp` of
/// <https://github.com/ros2/rosbag2>.
const PROPERTIES: [(&str, &str); 2] = [
    ("offered_qos_profiles", "offered_qos_profiles"),
    ("type_description_hash", "topic_type_hash"),
];

/// Passes the messages of a file to a visitor; returns the reason why the file ends early, if it does.
pub(super) fn visit(
    part: &mut ContainerFile,
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Option<String>, InputError> {
    let damaged = |error: rusqlite::Error| {
        if is_inaccessible(&error) {
            return InputError::unreadable(file, io::Error::other(error));
        }
        let problem = Problem::Damaged { source: Box::new(error), advice: Some(ADVICE) };
        InputError::of_file(file, problem)
    };
    let whole = whole_pages(&part.path).map_err(|source| InputError::unreadable(file, source))?;
    let path = whole.as_deref().unwrap_or(&part.path);
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let database = Connection::open_with_flags(path, flags).map_err(damaged)?;
    // An untrusted schema must not run code. A file shorter than its first page states is opened only with a
    // writable schema; this connection is read-only.
    database
        .execute_batch(
            "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA writable_schema = ON",
        )
        .map_err(damaged)?;
    for table in ["topics", "messages"] {
        if !has_table(&database, table).map_err(damaged)? {
            return Err(InputError::of_file(file, Problem::Foreign(FileKind::Sqlite)));
        }
    }
    let has_definitions = has_table(&database, "message_definitions").map_err(damaged)?;
    let topics = topics(&database, has_definitions, visitor).map_err(damaged)?;
    // Order in which they were written.
    let mut statement = database
        .prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
        .map_err(damaged)?;
    let mut rows = statement.query([]).map_err(damaged)?;
    let mut count = 0;
    loop {
        let row = match rows.next() {
            Ok(None) => return Ok(None),
            Ok(Some(row)) => row,
            // A page beyond the end of a truncated file.
            Err(error) if count > 0 && is_cut_off(&error, &part.path) => {
                return Ok(Some(error.to_string()));
            }
            Err(error) => return Err(damaged(error)),
        };
        count += 1;
        let topic: i64 = row.get(0).map_err(damaged)?;
        let Some(Topic { channel, is_needed: true }) = topics.get(&topic) else {
            continue;
        };
        let log_ns: i64 = row.get(1).map_err(damaged)?;
        let times = MessageTimes { log_ns, publish_ns: log_ns, sequence: None };
        let payload = match row.get_ref(2).map_err(damaged)? {
            ValueRef::Blob(payload) => payload,
            _ => &[],
        };
        visitor.message(channel, times, payload)?;
    }
}

/// Returns a copy of a file that ends within a page, without that page, because `SQLite` would read zeros in place of the
/// missing part, and so damaged messages. `None` if the file consists of whole pages. Source:
/// <https://www.sqlite.org/fileformat.html>, section 1.3.2.
fn whole_pages(path: &Path) -> io::Result<Option<TempPath>> {
    let mut file = File::open(path)?;
    let mut header = [0; 32];
    if file.read_exact(&mut header).is_err() {
        return Ok(None);
    }
    let page = page_size(&header);
    let length = file.metadata()?.len();
    if page < 512 || length % page == 0 {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(0))?;
    let mut copy = NamedTempFile::new()?;
    io::copy(&mut file.take(length - length % page), &mut copy)?;
    Ok(Some(copy.into_temp_path()))
}

/// Returns whether a table exists, as a table and not as a view, which may compute without end.
fn has_table(database: &Connection, name: &str) -> rusqlite::Result<bool> {
    let select = "SELECT count(*) = 1 FROM sqlite_master WHERE type = 'table' AND name = ?1";
    database.query_row(select, [name], |row| row.get(0))
}

/// Row of the table `topics`.
struct Topic {
    channel: Channel,
    /// Whether the visitor needs the messages.
    is_needed: bool,
}

/// Topics by their numbers.
fn topics(
    database: &Connection,
    has_definitions: bool,
    visitor: &mut dyn Visitor,
) -> rusqlite::Result<HashMap<i64, Topic>> {
    // Columns were added over the years.
    let mut statement = database.prepare("SELECT * FROM topics")?;
    let properties: Vec<(&str, usize)> = PROPERTIES
        .iter()
        .filter_map(|(column, key)| Some((*key, statement.column_index(column).ok()?)))
        .collect();
    let mut rows = statement.query([])?;
    let mut topics = HashMap::new();
    while let Some(row) = rows.next()? {
        let message: String = row.get("type")?;
        let properties = properties.iter().filter_map(|(key, column)| {
            let text: String = row.get(*column).ok()?;
            (!text.is_empty()).then(|| ((*key).to_owned(), text))
        });
        let channel = Channel {
            topic: row.get("name")?,
            schema: has_definitions.then(|| schema(database, &message)).flatten(),
            message,
            encoding: row.get("serialization_format")?,
            metadata: properties.collect(),
        };
        let is_needed = visitor.channel(&channel);
        topics.insert(row.get("id")?, Topic { channel, is_needed });
    }
    Ok(topics)
}

/// Definition of a type. Bags of ROS 2 Iron and later have the table, but not for all types.
fn schema(database: &Connection, message: &str) -> Option<Arc<Schema>> {
    let select = "SELECT encoding, encoded_message_definition FROM message_definitions \
                  WHERE topic_type = ?1";
    let schema = database.query_row(select, [message], |row| {
        let text: String = row.get(1)?;
        Ok(Schema { encoding: row.get(0)?, text: text.into_bytes() })
    });
    schema.ok().filter(|schema| !schema.text.is_empty()).map(Arc::new)
}

/// Returns whether an error is about the access to a file, such as a lock of the program that writes it or a failing disk,
/// and not about its content.
fn is_inaccessible(error: &rusqlite::Error) -> bool {
    match error.sqlite_error_code() {
        Some(ErrorCode::SystemIoFailure) => !is_short_read(error),
        Some(
            ErrorCode::DatabaseBusy
            | ErrorCode::DatabaseLocked
            | ErrorCode::CannotOpen
            | ErrorCode::PermissionDenied
            | ErrorCode::ReadOnly,
        ) => true,
        _ => false,
    }
}

/// Returns whether an error of reading comes from the end of a file, and not from a disk.
fn is_short_read(error: &rusqlite::Error) -> bool {
    let code = error.sqlite_error().map(|error| error.extended_code);
    code == Some(ffi::SQLITE_IOERR_SHORT_READ)
}

/// Returns whether an error comes from a file that ends early, and not from a damaged file.
fn is_cut_off(error: &rusqlite::Error, path: &Path) -> bool {
    match error.sqlite_error_code() {
        Some(ErrorCode::SystemIoFailure) => is_short_read(error),
        Some(ErrorCode::DatabaseCorrupt) => is_shorter_than_stated(path).unwrap_or(false),
        _ => false,
    }
}

/// Returns whether a file has fewer pages than its first page states. Source:
/// <https://www.sqlite.org/fileformat.html>, section 1.3.7.
fn is_shorter_than_stated(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut header = [0; 32];
    file.read_exact(&mut header)?;
    let pages = u32::from_be_bytes([header[28], header[29], header[30], header[31]]);
    let stated = page_size(&header).saturating_mul(u64::from(pages));
    Ok(file.metadata()?.len() < stated)
}

/// Size of a page in bytes, from the beginning of a file.
fn page_size(header: &[u8; 32]) -> u64 {
    match u16::from_be_bytes([header[16], header[17]]) {
        1 => 65_536,
        size => u64::from(size),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failing_disk_is_no_early_end() {
        let error = |code| rusqlite::Error::SqliteFailure(ffi::Error::new(code), None);
        let path = Path::new("walk.db3");
        let short = error(ffi::SQLITE_IOERR_SHORT_READ);
        assert!(is_cut_off(&short, path) && !is_inaccessible(&short));
        let failing = error(ffi::SQLITE_IOERR_READ);
        assert!(!is_cut_off(&failing, path) && is_inaccessible(&failing));
    }
}
