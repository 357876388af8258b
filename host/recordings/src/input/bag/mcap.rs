//! MCAP: a sequence of records, some of them in chunks. The summary and the index are not used. Source:
//! <https://mcap.dev/spec>.

use std::collections::HashMap;
use std::io::{self, Read};
use std::rc::Rc;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::super::error::InputError;
use super::super::open::Part;
use super::super::refusal::ContainerError;
use super::storage::{Channel, Schema, Visitor};

/// Longest record that is read, bytes: a picture of 64 million pixels is longer.
const LONGEST_RECORD: usize = 256 << 20;

/// Most bytes read at once: the declared length of a record may exceed the data.
const AT_ONCE: usize = 1 << 20;

/// Advice in the error about a file that is damaged rather than truncated.
const ADVICE: &str = "mcap recover, of the MCAP CLI, saves what can be";

/// Reason to stop reading a file.
enum Stop {
    /// The file ends early, for this reason.
    Early(String),
    Unreadable(io::Error),
    Damaged(McapError),
    /// The visitor refused a message.
    Refused(InputError),
}

/// Passes the messages of a file to a visitor; returns the reason why the file ends early, if it does.
pub(super) fn visit(
    part: &mut Part,
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Option<String>, InputError> {
    let mut bag = Bag {
        schemas: HashMap::new(),
        channels: HashMap::new(),
        visitor,
    };
    let bytes = part.bytes().map_err(Stop::Unreadable);
    let read = bytes.and_then(|mut bytes| bag.file(&mut bytes));
    match read {
        Ok(()) => Ok(None),
        Err(Stop::Early(why)) => Ok(Some(why)),
        Err(Stop::Unreadable(source)) => Err(InputError::unreadable(file, source)),
        Err(Stop::Damaged(error)) => Err(ContainerError::Damaged {
            file: file.to_owned(),
            source: Box::new(error),
            advice: Some(ADVICE),
        }
        .into()),
        Err(Stop::Refused(error)) => Err(error),
    }
}

/// State of the parser.
struct Bag<'a> {
    /// Names of types, with their definitions.
    schemas: HashMap<u16, (String, Option<Rc<Schema>>)>,
    /// Channels, and whether their messages are needed.
    channels: HashMap<u16, (Channel, bool)>,
    visitor: &'a mut dyn Visitor,
}

impl Bag<'_> {
    /// Reads all records up to the end of the messages.
    fn file(&mut self, bytes: &mut dyn Read) -> Result<(), Stop> {
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(LONGEST_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event.map_err(Stop::Damaged)? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let room = reader.insert(wanted.clamp(1, AT_ONCE));
                    let count = read_some(bytes, room).map_err(Stop::Unreadable)?;
                    if count == 0 {
                        return Err(Stop::Early(McapError::UnexpectedEof.to_string()));
                    }
                    reader.notify_read(count);
                }
                LinearReadEvent::Record { opcode, data } => match opcode {
                    // The records after the messages are not needed.
                    op::DATA_END | op::FOOTER => return Ok(()),
                    // File systems leave zeros after a loss of power.
                    0 => return Err(Stop::Early("zeros follow".to_owned())),
                    op::SCHEMA | op::CHANNEL | op::MESSAGE => self.take(opcode, data)?,
                    _ => {}
                },
            }
        }
        Ok(())
    }

    /// Processes a record.
    fn take(&mut self, opcode: u8, record: &[u8]) -> Result<(), Stop> {
        match mcap::parse_record(opcode, record).map_err(Stop::Damaged)? {
            Record::Schema { header, data } => {
                let schema = Schema {
                    encoding: header.encoding,
                    text: data.into_owned(),
                };
                self.schemas
                    .insert(header.id, (header.name, Some(schema.into())));
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id);
                let (message, schema) = schema.cloned().unwrap_or_default();
                let declared = Channel {
                    topic: channel.topic,
                    message,
                    encoding: channel.message_encoding,
                    schema,
                };
                let is_needed = self.visitor.channel(&declared);
                self.channels.insert(channel.id, (declared, is_needed));
            }
            Record::Message { header, data } => {
                if let Some((channel, true)) = self.channels.get(&header.channel_id) {
                    let log_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                    let shown = self.visitor.message(channel, log_ns, &data);
                    shown.map_err(Stop::Refused)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Reads the available bytes; 0 at the end.
fn read_some(bytes: &mut dyn Read, room: &mut [u8]) -> io::Result<usize> {
    loop {
        match bytes.read(room) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
