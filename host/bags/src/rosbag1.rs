//! Bags of ROS 1, version 2.0: a sequence of records, most of them in chunks. The index is not used. Source:
//! <http://wiki.ros.org/Bags/Format/2.0>.
//!
//! A record is a header of named fields, and data. The header of a chunk that is being written has the length 0: its records
//! reach to the end of the file.

use std::collections::HashMap;
use std::io::{self, BufReader, Read, Take};
use std::sync::Arc;

use bzip2::read::BzDecoder;
use thiserror::Error;

use crate::messages::{Channel, MessageTimes, Schema, Visitor};
use crate::records::{
    AT_ONCE, Connection, LONGEST_CHUNK, LONGEST_RECORD, Stop, expect_at_most, load, number,
    read_some, skip,
};
use stored::container::ContainerFile;
use stored::error::{InputError, Unsupported};

/// Length of the first line.
const VERSION: u64 = b"#ROSBAG V2.0\n".len() as u64;

/// Longest header of a record, bytes. Topics are the longest fields.
const LONGEST_HEADER: u32 = 1 << 20;

/// Advice in the error about a file that is damaged rather than truncated.
const ADVICE: &str = "rosbag reindex, of ROS 1, saves what can be";

/// Kinds of records: the field `op`.
mod op {
    pub(super) const MESSAGE: u8 = 2;
    pub(super) const BAG: u8 = 3;
    pub(super) const CHUNK: u8 = 5;
    pub(super) const CONNECTION: u8 = 7;
}

/// Damage of a file.
#[derive(Debug, Error)]
enum Damage {
    #[error("a record has a header of {0} bytes")]
    LongHeader(u32),
    #[error("the header of a record is not made of fields")]
    Fields,
    #[error("a record lacks the field {0}")]
    Field(&'static str),
    #[error("a record has {0} bytes")]
    LongRecord(u32),
    #[error("a chunk ends within a record")]
    Chunk,
    #[error("a chunk has {found} bytes instead of {stated}")]
    ChunkSize { found: u64, stated: u64 },
    #[error("a chunk cannot be decompressed: {0}")]
    Compression(io::Error),
}

impl From<Damage> for Stop {
    fn from(damage: Damage) -> Self {
        Self::Damaged(Box::new(damage))
    }
}

/// Passes the messages of a file to a visitor; returns the reason why the file ends early, if it does.
pub(super) fn visit(
    part: &mut ContainerFile,
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Option<String>, InputError> {
    let mut bag =
        Bag { connections: HashMap::new(), visitor, header: Vec::new(), data: Vec::new() };
    let read = part.bytes().map_err(Stop::Unreadable).and_then(|bytes| {
        let bytes = BufReader::with_capacity(AT_ONCE, bytes);
        bag.file(&mut Counted::new(bytes))
    });
    match read {
        Ok(()) => Ok(None),
        Err(stop) => stop.ending(file, ADVICE).map(Some),
    }
}

/// Reader with the number of bytes that were read.
struct Counted<R> {
    bytes: R,
    count: u64,
}

impl<R> Counted<R> {
    const fn new(bytes: R) -> Self {
        Self { bytes, count: 0 }
    }
}

/// Reader of a file.
type FileBytes = Counted<BufReader<Box<dyn Read>>>;

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(room)?;
        self.count += count as u64;
        Ok(count)
    }
}

/// State of the parser.
struct Bag<'a> {
    connections: HashMap<u32, Connection>,
    visitor: &'a mut dyn Visitor,
    /// Header of the current record.
    header: Vec<u8>,
    /// Data of the current record.
    data: Vec<u8>,
}

impl Bag<'_> {
    /// Reads all records.
    fn file(&mut self, bytes: &mut FileBytes) -> Result<(), Stop> {
        skip(bytes, VERSION)?;
        // Position of the index, behind the last message; 0 until the recording is closed.
        let mut index = 0;
        loop {
            let start = bytes.count;
            let read = self.record(bytes, &mut index);
            let is_in_index = index > 0 && start >= index;
            match read {
                Ok(true) => {}
                Ok(false) if is_in_index => return Ok(()),
                Ok(false) => return Err(Stop::Early("it has no index")),
                // An index that is cut off loses no message.
                Err(Stop::Early(_)) if is_in_index => return Ok(()),
                Err(stop) => return Err(stop),
            }
        }
    }

    /// Reads a record that is not within a chunk; returns whether there was one.
    fn record(&mut self, bytes: &mut FileBytes, index: &mut u64) -> Result<bool, Stop> {
        if !self.load_header(bytes)? {
            return Ok(false);
        }
        let length = length(bytes)?;
        match self.op()? {
            op::BAG => {
                *index = self.number::<8>("index_pos")?;
                let encryptor = self.field("encryptor")?.unwrap_or_default();
                if !encryptor.is_empty() {
                    let encryptor = String::from_utf8_lossy(encryptor).into_owned();
                    return Err(Stop::NotSupported(Unsupported::Encryption(encryptor)));
                }
                skip(bytes, length.into())?;
            }
            op::CHUNK => self.chunk(bytes, length)?,
            // The records of an unfinished chunk follow its header directly.
            _ => self.process(bytes, length)?,
        }
        Ok(true)
    }

    /// Reads the records of a chunk.
    fn chunk(&mut self, bytes: &mut FileBytes, length: u32) -> Result<(), Stop> {
        let compression = self.field("compression")?.ok_or(Damage::Field("compression"))?;
        let compression = String::from_utf8_lossy(compression).into_owned();
        // A compressed chunk is never 0 bytes long, so length 0 means that it is still being written.
        let is_open = length == 0 && compression != "none";
        let length = if is_open { u64::MAX } else { length.into() };
        let size = self.number::<4>("size")?;
        let stated = (!is_open).then_some(size);
        let mut chunk = bytes.take(length);
        let read = match compression.as_str() {
            "none" => self.records(&mut chunk),
            "bz2" => self.compressed(BzDecoder::new(&mut chunk), stated),
            "lz4" => lz4::Decoder::new(&mut chunk)
                .map_err(Stop::from)
                .and_then(|chunk| self.compressed(chunk, stated)),
            _ => return Err(Stop::NotSupported(Unsupported::Compression(compression))),
        };
        if is_open {
            return match read {
                Ok(()) | Err(Stop::Damaged(_)) => {
                    Err(Stop::Early("its last chunk is not finished"))
                }
                stop => stop,
            };
        }
        if let Err(stop @ Stop::Damaged(_)) = read {
            // The decoder reports a chunk without an end as damaged.
            return Err(if is_at_end(&mut chunk)? { Stop::CUT } else { stop });
        }
        read?;
        let rest = chunk.limit();
        skip(bytes, rest)
    }

    /// Reads the records of a compressed chunk by its decoder, up to the size that its header states; `None` for a chunk that
    /// was not finished. Not every decoder reports truncated data, so the size is compared with the header's.
    fn compressed(&mut self, decoder: impl Read, stated: Option<u64>) -> Result<(), Stop> {
        let most = stated.unwrap_or(LONGEST_CHUNK);
        let mut chunk = Counted::new(decoder.take(most + 1));
        let read = self.records(&mut chunk);
        let found = chunk.count;
        expect_at_most(most, found)?;
        read?;
        match stated {
            Some(stated) if found != stated => Err(Damage::ChunkSize { found, stated }.into()),
            _ => Ok(()),
        }
    }

    /// Reads records up to the end of a chunk.
    fn records(&mut self, chunk: &mut impl Read) -> Result<(), Stop> {
        let mut record = || {
            if !self.load_header(chunk)? {
                return Ok(false);
            }
            let length = length(chunk)?;
            self.process(chunk, length)?;
            Ok(true)
        };
        loop {
            match record() {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(Stop::Early(_)) => return Err(Damage::Chunk.into()),
                Err(Stop::Unreadable(error)) if error.raw_os_error().is_none() => {
                    return Err(Damage::Compression(error).into());
                }
                Err(stop) => return Err(stop),
            }
        }
    }

    /// Reads the header of the next record; returns whether there is one.
    fn load_header(&mut self, from: &mut impl Read) -> Result<bool, Stop> {
        let mut first = [0; 1];
        if read_some(from, &mut first)? == 0 {
            return Ok(false);
        }
        let mut others = [0; 3];
        from.read_exact(&mut others)?;
        let length = u32::from_le_bytes([first[0], others[0], others[1], others[2]]);
        match length {
            0 => return Err(Stop::ZEROS),
            1..=LONGEST_HEADER => load(&mut self.header, from, length.into())?,
            _ => return Err(Damage::LongHeader(length).into()),
        }
        Ok(true)
    }

    /// Processes the data of the current record, which follow its header.
    fn process(&mut self, from: &mut impl Read, length: u32) -> Result<(), Stop> {
        match self.op()? {
            op::MESSAGE => {
                let connection = self.number::<4>("conn")? as u32;
                let Some(connection) = self.connections.get(&connection) else {
                    return skip(from, length.into());
                };
                if !connection.is_needed {
                    return skip(from, length.into());
                }
                let time = self.number::<8>("time")?;
                load_data(&mut self.data, from, length)?;
                let (seconds, nanoseconds) = (time & 0xFFFF_FFFF, time >> 32);
                let log_ns = (seconds * 1_000_000_000 + nanoseconds).cast_signed();
                let times = MessageTimes { log_ns, publish_ns: log_ns, sequence: None };
                connection.pass(times, &self.data, self.visitor)
            }
            op::CONNECTION => {
                load_data(&mut self.data, from, length)?;
                self.connect()
            }
            _ => skip(from, length.into()),
        }
    }

    /// Adds the connection of the current record. The index of the bag repeats all connections.
    fn connect(&mut self) -> Result<(), Stop> {
        let id = self.number::<4>("conn")? as u32;
        if self.connections.contains_key(&id) {
            return Ok(());
        }
        let topic = self.field("topic")?.ok_or(Damage::Field("topic"))?;
        let message = field(&self.data, "type")?.ok_or(Damage::Field("type"))?;
        let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
        let definition = field(&self.data, "message_definition")?.unwrap_or_default().to_vec();
        let channel = Channel {
            topic: text(topic),
            message: text(message),
            encoding: "ros1".to_owned(),
            schema: Some(Arc::new(Schema { encoding: "ros1msg".to_owned(), text: definition })),
            metadata: Default::default(),
        };
        self.connections.insert(id, Connection::declare(channel, self.visitor));
        Ok(())
    }

    /// Kind of the current record.
    fn op(&self) -> Result<u8, Damage> {
        Ok(self.number::<1>("op")? as u8)
    }

    /// A field of the header of the current record.
    fn field(&self, name: &str) -> Result<Option<&[u8]>, Damage> {
        field(&self.header, name)
    }

    /// A little-endian number of `N` bytes in the header of the current record.
    fn number<const N: usize>(&self, name: &'static str) -> Result<u64, Damage> {
        let bytes: &[u8; N] =
            self.field(name)?.and_then(|bytes| bytes.try_into().ok()).ok_or(Damage::Field(name))?;
        Ok(number(bytes))
    }
}

/// Returns the value of a field. Each of `fields` is a length and `name=value`.
fn field<'a>(mut fields: &'a [u8], name: &str) -> Result<Option<&'a [u8]>, Damage> {
    while let Some((length, rest)) = fields.split_first_chunk() {
        let (field, rest) =
            rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or(Damage::Fields)?;
        let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
        if value.is_some() {
            return Ok(value);
        }
        fields = rest;
    }
    if fields.is_empty() { Ok(None) } else { Err(Damage::Fields) }
}

/// Length of the data of a record.
fn length(from: &mut impl Read) -> Result<u32, Stop> {
    let mut bytes = [0; 4];
    from.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

/// Reads the data of a record.
fn load_data(data: &mut Vec<u8>, from: &mut impl Read, length: u32) -> Result<(), Stop> {
    if length as usize > LONGEST_RECORD {
        return Err(Damage::LongRecord(length).into());
    }
    load(data, from, length.into())
}

/// Returns whether a file ends before the rest of a chunk, which is skipped.
fn is_at_end(chunk: &mut Take<&mut FileBytes>) -> io::Result<bool> {
    io::copy(chunk, &mut io::sink())?;
    Ok(chunk.limit() > 0)
}
