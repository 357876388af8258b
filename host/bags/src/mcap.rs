//! MCAP: a sequence of records, some of them in chunks. The summary and the index are not used. Source:
//! <https://mcap.dev/spec>.
//!
//! The frames of records are parsed here, so that attachments take no memory and the records before the end of a
//! truncated file are found; contents and compressed chunks are parsed by the library.

use std::collections::HashMap;
use std::io::{BufReader, Read, Take};
use std::sync::Arc;

use crc32fast::Hasher;
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::messages::{Channel, MessageTimes, Schema, Visitor};
use crate::records::{
    AT_ONCE, Connection, LONGEST_CHUNK, LONGEST_RECORD, Stop, expect_at_most, load, number,
    read_some, skip,
};
use stored::container::ContainerFile;
use stored::error::InputError;

/// The bytes at the start and at the end of a file.
const MAGIC: &[u8] = mcap::MAGIC;

/// Length of the fields of a chunk before the name of its compression: two times, its size, its CRC, and the
/// length of the name.
const CHUNK_START: usize = 8 + 8 + 8 + 4 + 4;

/// Longest name of a compression, bytes.
const LONGEST_NAME: u32 = 64;

/// Advice in the error about a file that is damaged rather than truncated.
const ADVICE: &str = "mcap recover, of the MCAP CLI, saves what can be";

/// Reader of a file.
type Bytes = BufReader<Box<dyn Read>>;

impl From<McapError> for Stop {
    fn from(error: McapError) -> Self {
        Self::Damaged(Box::new(error))
    }
}

/// Passes the messages of a file to a visitor; returns the reason why the file ends early, if it does.
pub(super) fn visit(
    part: &mut ContainerFile,
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Option<String>, InputError> {
    let read = part.bytes().map_err(Stop::Unreadable).and_then(|bytes| {
        let mut bytes = BufReader::with_capacity(AT_ONCE, bytes);
        skip(&mut bytes, MAGIC.len() as u64)?;
        loop {
            let mut bag = Bag {
                types: HashMap::new(),
                connections: HashMap::new(),
                visitor: &mut *visitor,
                record: Vec::new(),
            };
            let end = bag.file(&mut bytes)?;
            if !begins_another(&mut bytes, end)? {
                return Ok(());
            }
        }
    });
    match read {
        Ok(()) => Ok(None),
        Err(stop) => stop.ending(file, ADVICE).map(Some),
    }
}

/// Passes over the rest of a file from the frame of the record that ends its messages, and over the start of another file
/// after it: `cat` joins files. The rest may be cut off.
fn begins_another(bytes: &mut Bytes, end: Frame) -> Result<bool, Stop> {
    let rest = || {
        let mut frame = end;
        loop {
            skip(bytes, frame.length)?;
            if frame.opcode == op::FOOTER {
                return skip(bytes, MAGIC.len() as u64);
            }
            frame = Frame::read(bytes)?;
        }
    };
    match rest() {
        Ok(()) => {}
        Err(Stop::Early(_)) => return Ok(false),
        Err(stop) => return Err(stop),
    }
    let mut next = Vec::new();
    bytes.take(MAGIC.len() as u64).read_to_end(&mut next)?;
    if next.is_empty() || next == MAGIC {
        return Ok(!next.is_empty());
    }
    Err(Stop::Early("other data follow its end"))
}

/// Beginning of a record.
struct Frame {
    opcode: u8,
    /// Length of the content, bytes.
    length: u64,
}

impl Frame {
    const SIZE: usize = 1 + 8;

    /// Reads the frame of the next record.
    fn read(bytes: &mut Bytes) -> Result<Self, Stop> {
        let mut frame = [0; Self::SIZE];
        bytes.read_exact(&mut frame)?;
        Ok(Self::of_bytes(frame))
    }

    fn of_bytes(bytes: [u8; Self::SIZE]) -> Self {
        Self { opcode: bytes[0], length: number(&bytes[1..]) }
    }
}

/// Type as declared in a file.
#[derive(Clone, Default)]
struct MessageType {
    name: String,
    definition: Option<Arc<Schema>>,
}

/// State of the parser.
struct Bag<'a> {
    types: HashMap<u16, MessageType>,
    connections: HashMap<u16, Connection>,
    visitor: &'a mut dyn Visitor,
    /// The current record.
    record: Vec<u8>,
}

impl Bag<'_> {
    /// Reads all records up to the end of the messages. Returns the frame of the record that ends them.
    fn file(&mut self, bytes: &mut Bytes) -> Result<Frame, Stop> {
        loop {
            let frame = Frame::read(bytes)?;
            let Frame { opcode, length } = frame;
            match opcode {
                op::DATA_END | op::FOOTER => return Ok(frame),
                0 => return Err(Stop::ZEROS),
                op::CHUNK => {
                    let mut chunk = bytes.take(length);
                    self.chunk(&mut chunk, length)?;
                    let padding = chunk.limit();
                    skip(bytes, padding)?;
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    self.load(bytes, opcode, length)?;
                    self.process(opcode)?;
                }
                _ => skip(bytes, length)?,
            }
        }
    }

    /// Reads the records of a chunk.
    fn chunk(&mut self, chunk: &mut Take<&mut Bytes>, length: u64) -> Result<(), Stop> {
        let too_short = |header| McapError::BadChunkLength { header, available: length };
        if length < CHUNK_START as u64 {
            return Err(too_short(CHUNK_START as u64).into());
        }
        let mut header = vec![0; CHUNK_START];
        chunk.read_exact(&mut header)?;
        // Two times come first.
        let stated = number(&header[16..24]);
        let crc = number(&header[24..28]) as u32;
        let name_length = number(&header[28..32]) as u32;
        let rest = u64::from(name_length) + 8;
        if name_length > LONGEST_NAME || chunk.limit() < rest {
            return Err(too_short(CHUNK_START as u64 + rest).into());
        }
        header.resize(CHUNK_START + rest as usize, 0);
        chunk.read_exact(&mut header[CHUNK_START..])?;
        let size = number(&header[CHUNK_START + name_length as usize..]);
        if chunk.limit() < size {
            return Err(too_short(size).into());
        }
        if name_length == 0 {
            self.plain_chunk(&mut chunk.take(size), crc)
        } else {
            self.compressed_chunk(chunk, &header, length, stated)
        }
    }

    fn plain_chunk(&mut self, records: &mut Take<impl Read>, crc: u32) -> Result<(), Stop> {
        let mut hasher = Hasher::new();
        while records.limit() > 0 {
            if records.limit() < Frame::SIZE as u64 {
                return Err(McapError::UnexpectedEoc.into());
            }
            let mut bytes = [0; Frame::SIZE];
            records.read_exact(&mut bytes)?;
            let Frame { opcode, length } = Frame::of_bytes(bytes);
            if records.limit() < length {
                return Err(McapError::UnexpectedEoc.into());
            }
            self.load(records, opcode, length)?;
            hasher.update(&bytes);
            hasher.update(&self.record);
            self.process(opcode)?;
        }
        let calculated = hasher.finalize();
        if crc != 0 && crc != calculated {
            return Err(McapError::BadChunkCrc { saved: crc, calculated }.into());
        }
        Ok(())
    }

    /// Reads a compressed chunk whose frame and header were read; the library reads them again. `stated` is the length of
    /// its records, bytes.
    fn compressed_chunk(
        &mut self,
        chunk: &mut Take<&mut Bytes>,
        header: &[u8],
        length: u64,
        stated: u64,
    ) -> Result<(), Stop> {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(LONGEST_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        let length = length.to_le_bytes();
        let before = (&[op::CHUNK][..]).chain(&length[..]).chain(header);
        let mut bytes = before.chain(chunk);
        let mut decompressed = 0;
        while let Some(event) = reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    // Memory grows with the data read, because the declared length may exceed the data.
                    let room = reader.insert(wanted.clamp(1, 16 * AT_ONCE));
                    let count = read_some(&mut bytes, room)?;
                    if count == 0 && bytes.get_ref().1.limit() > 0 {
                        return Err(Stop::CUT);
                    }
                    reader.notify_read(count);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    decompressed += (Frame::SIZE + data.len()) as u64;
                    expect_at_most(stated.min(LONGEST_CHUNK), decompressed)?;
                    self.record.clear();
                    self.record.extend_from_slice(data);
                    self.process(opcode)?;
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Reads the content of a record.
    fn load(&mut self, from: &mut impl Read, opcode: u8, length: u64) -> Result<(), Stop> {
        if length > LONGEST_RECORD as u64 {
            return Err(McapError::RecordTooLarge { opcode, len: length }.into());
        }
        load(&mut self.record, from, length)
    }

    /// Processes the current record.
    fn process(&mut self, opcode: u8) -> Result<(), Stop> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match mcap::parse_record(opcode, &self.record)? {
            Record::Schema { header, data } => {
                let definition = Schema { encoding: header.encoding, text: data.into_owned() };
                let definition = Some(Arc::new(definition));
                self.types.insert(header.id, MessageType { name: header.name, definition });
            }
            Record::Channel(channel) => {
                let message_type = self.types.get(&channel.schema_id);
                let MessageType { name, definition } = message_type.cloned().unwrap_or_default();
                let declared = Channel {
                    topic: channel.topic,
                    message: name,
                    encoding: channel.message_encoding,
                    schema: definition,
                    metadata: channel.metadata,
                };
                let connection = Connection::declare(declared, self.visitor);
                self.connections.insert(channel.id, connection);
            }
            Record::Message { header, data } => {
                let connection = self.connections.get(&header.channel_id);
                if let Some(connection) = connection.filter(|connection| connection.is_needed) {
                    let nanos = |time| i64::try_from(time).unwrap_or(i64::MAX);
                    let times = MessageTimes {
                        log_ns: nanos(header.log_time),
                        publish_ns: nanos(header.publish_time),
                        sequence: Some(header.sequence),
                    };
                    connection.pass(times, &data, self.visitor)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}
