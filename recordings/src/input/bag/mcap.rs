//! MCAP: records one after the other, some of them in compressed chunks. Neither the summary nor
//! the index is needed. Source: <https://mcap.dev/spec>.

use std::collections::HashMap;
use std::io::{self, Read};

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::super::error::InputError;
use super::super::open::Part;
use super::super::refusal::ContainerError;
use super::storage::{Channel, End, Interest, Visitor};

/// No record is longer, bytes: a picture of 64 million pixels is not.
const LONGEST_RECORD: usize = 256 << 20;

/// As much is read at once, bytes.
const AT_ONCE: usize = 64 << 10;

/// What is said where a file is damaged and not only cut off.
const ADVICE: &str = "mcap recover, of the MCAP CLI, saves what can be";

/// What is known so far.
struct Bag<'a> {
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, (Channel, Interest)>,
    visitor: &'a mut dyn Visitor,
}

/// Shows the messages of a file to a visitor.
pub(super) fn visit(
    part: &mut Part,
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<End, InputError> {
    let mut bytes = part.bytes().map_err(|source| unreadable(file, source))?;
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut bag = Bag {
        schemas: HashMap::new(),
        channels: HashMap::new(),
        visitor,
    };
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                // What a length promises may not be there: memory grows with what is.
                let room = reader.insert(wanted.clamp(AT_ONCE, 16 * AT_ONCE));
                let count = read(&mut bytes, room).map_err(|source| unreadable(file, source))?;
                reader.notify_read(count);
            }
            // What follows the messages is not needed.
            Ok(LinearReadEvent::Record {
                opcode: op::DATA_END | op::FOOTER,
                ..
            }) => return Ok(End::Complete),
            // A file system that lost its power leaves zeros.
            Ok(LinearReadEvent::Record { opcode: 0, .. }) => {
                return Ok(End::Early("zeros follow".to_owned()));
            }
            Ok(LinearReadEvent::Record { opcode, data }) => bag.record(opcode, data, file)?,
            Err(error @ (McapError::UnexpectedEof | McapError::UnexpectedEoc)) => {
                return Ok(End::Early(error.to_string()));
            }
            Err(error) => return Err(damaged(file, error)),
        }
    }
    Ok(End::Complete)
}

impl Bag<'_> {
    fn record(&mut self, opcode: u8, data: &[u8], file: &str) -> Result<(), InputError> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match mcap::parse_record(opcode, data).map_err(|error| damaged(file, error))? {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let message = self.schemas.get(&channel.schema_id);
                let declared = Channel {
                    topic: channel.topic,
                    message: message.cloned().unwrap_or_default(),
                    encoding: channel.message_encoding,
                };
                let interest = self.visitor.channel(&declared);
                self.channels.insert(channel.id, (declared, interest));
            }
            Record::Message { header, data } => {
                if let Some((channel, Interest::Wanted)) = self.channels.get(&header.channel_id) {
                    let log_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                    self.visitor.message(channel, log_ns, &data)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Reads what there is; 0 at the end.
fn read(bytes: &mut dyn Read, room: &mut [u8]) -> io::Result<usize> {
    loop {
        match bytes.read(room) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

fn unreadable(file: &str, source: io::Error) -> InputError {
    InputError::Unreadable {
        file: file.to_owned(),
        source,
    }
}

fn damaged(file: &str, error: McapError) -> InputError {
    ContainerError::Damaged {
        file: file.to_owned(),
        source: Box::new(error),
        advice: Some(ADVICE),
    }
    .into()
}
