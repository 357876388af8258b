//! Recording to a rosbag2 folder: an `SQLite` database readable by Humble and later, and `metadata.yaml`.
//! Sources: `sqlite_storage.cpp` and `metadata_io.cpp` of <https://github.com/ros2/rosbag2>.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rusqlite::{Connection, params};
use thiserror::Error;

use crate::definition::Definition;
use crate::published::Published;

/// Tables of storage version 3.
const TABLES: &str = "
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
    data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema(schema_version, ros_distro) VALUES (3, 'humble');
";

/// Version of `metadata.yaml` written by Humble.
const METADATA_VERSION: u32 = 5;

/// Reason why a bag cannot be written.
#[derive(Debug, Error)]
pub enum Rosbag2Error {
    /// The database cannot be written.
    #[error(transparent)]
    Database(#[from] rusqlite::Error),
    /// The folder cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Writer of a bag.
pub struct Rosbag2File {
    folder: PathBuf,
    /// Name of the database in the folder.
    file: String,
    database: Connection,
    topics: BTreeMap<Arc<str>, Topic>,
    /// First and last time, ns since 1970.
    times_ns: Option<(i64, i64)>,
}

struct Topic {
    id: i64,
    message: &'static str,
    messages: u64,
}

impl Rosbag2File {
    /// Creates a bag of this name in an existing, empty folder.
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn new(folder: &Path, name: &str) -> Result<Self, Rosbag2Error> {
        let file = format!("{name}_0.db3");
        let database = Connection::open(folder.join(&file))?;
        // An unfinished bag is useless, so no rollback is needed.
        database.execute_batch("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN;")?;
        database.execute_batch(TABLES)?;
        Ok(Self {
            folder: folder.to_owned(),
            file,
            database,
            topics: BTreeMap::new(),
            times_ns: None,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn write(&mut self, published: &Published) -> Result<(), Rosbag2Error> {
        let id = self.topic(published)?;
        let micros = i64::try_from(published.at.as_micros()).unwrap_or(i64::MAX);
        let now_ns = micros.saturating_mul(1000);
        let (first, last) = self.times_ns.unwrap_or((now_ns, now_ns));
        self.times_ns = Some((first.min(now_ns), last.max(now_ns)));
        self.database.execute(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)",
            params![id, now_ns, published.message.cdr()],
        )?;
        Ok(())
    }

    /// Returns the id of a topic and counts one message; declares the topic if it is new.
    fn topic(&mut self, published: &Published) -> Result<i64, Rosbag2Error> {
        if let Some(topic) = self.topics.get_mut(&published.topic) {
            topic.messages += 1;
            return Ok(topic.id);
        }
        let id = self.topics.len() as i64 + 1;
        let message = Definition::of(&published.message).name;
        self.database.execute(
            "INSERT INTO topics(id, name, type, serialization_format, offered_qos_profiles) \
             VALUES (?1, ?2, ?3, 'cdr', '')",
            params![id, published.topic.as_ref(), message],
        )?;
        let messages = 1;
        let topic = Topic {
            id,
            message,
            messages,
        };
        self.topics.insert(Arc::clone(&published.topic), topic);
        Ok(id)
    }

    /// Commits the messages and writes `metadata.yaml`.
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn finish(self) -> Result<(), Rosbag2Error> {
        let mut metadata = String::new();
        // Writing to memory does not fail.
        let _: fmt::Result = self.write_metadata(&mut metadata);
        self.database.execute(
            "INSERT INTO metadata(metadata_version, metadata) VALUES (?1, ?2)",
            params![METADATA_VERSION, metadata],
        )?;
        self.database.execute_batch("COMMIT")?;
        self.database.close().map_err(|(_, error)| error)?;
        fs::write(self.folder.join("metadata.yaml"), metadata)?;
        Ok(())
    }

    fn write_metadata(&self, to: &mut String) -> fmt::Result {
        let (first, last) = self.times_ns.unwrap_or_default();
        let count: u64 = self.topics.values().map(|topic| topic.messages).sum();
        // A quoted text is valid YAML, whatever it contains.
        let file = format!("{:?}", self.file);
        writeln!(
            to,
            "rosbag2_bagfile_information:\n  version: {METADATA_VERSION}"
        )?;
        writeln!(to, "  storage_identifier: sqlite3")?;
        writeln!(to, "  duration:\n    nanoseconds: {}", last - first)?;
        writeln!(to, "  starting_time:\n    nanoseconds_since_epoch: {first}")?;
        writeln!(to, "  message_count: {count}\n  topics_with_message_count:")?;
        for (name, topic) in &self.topics {
            writeln!(to, "    - topic_metadata:\n        name: {name}")?;
            writeln!(to, "        type: {}", topic.message)?;
            writeln!(to, "        serialization_format: cdr")?;
            writeln!(to, "        offered_qos_profiles: \"\"")?;
            writeln!(to, "      message_count: {}", topic.messages)?;
        }
        writeln!(to, "  compression_format: \"\"\n  compression_mode: \"\"")?;
        writeln!(to, "  relative_file_paths:\n    - {file}")?;
        writeln!(to, "  files:\n    - path: {file}\n      starting_time:")?;
        writeln!(to, "        nanoseconds_since_epoch: {first}")?;
        writeln!(to, "      duration:\n        nanoseconds: {}", last - first)?;
        writeln!(to, "      message_count: {count}")
    }
}
