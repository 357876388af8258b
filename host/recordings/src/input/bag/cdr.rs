//! A stored message of ROS 2: CDR in either byte order, optionally compressed.
//!
//! The first four bytes give the encoding of the rest (DDSI-RTPS 2.5, section 10.5): 0 and 1 are plain CDR, big
//! and little endian. rosbag2 may compress each message with zstd; plain ones begin with a zero.

use std::borrow::Cow;
use std::io::{Cursor, Read};

use byteorder::{BigEndian, LittleEndian};
use cdr_encoding::from_bytes;
use serde::Deserialize;

use crate::samples::compressed::{ZSTD, decompressed};

/// Longest message after decompression, bytes.
const LONGEST_MESSAGE: u64 = 1 << 20;

/// Length of the encoding header, bytes.
pub(super) const ENCODING: usize = 4;

/// Most bytes that may follow a message: padding to a multiple of four.
pub(super) const LONGEST_PADDING: usize = 3;

/// Byte order of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

/// Content of a message, after its encoding.
pub(super) struct Content<'a> {
    pub(super) order: Order,
    pub(super) bytes: Cow<'a, [u8]>,
}

impl Content<'_> {
    /// First fields of the message, and the number of their bytes.
    fn decode<T: for<'de> Deserialize<'de>>(&self) -> cdr_encoding::Result<(T, usize)> {
        match self.order {
            Order::Big => from_bytes::<T, BigEndian>(&self.bytes),
            Order::Little => from_bytes::<T, LittleEndian>(&self.bytes),
        }
    }
}

/// Decompresses a message that is compressed, up to `longest` bytes; the error is half a sentence.
pub(super) fn decompressed_message(payload: &[u8], longest: u64) -> Result<Cow<'_, [u8]>, String> {
    if !payload.starts_with(&ZSTD) {
        return Ok(Cow::Borrowed(payload));
    }
    let mut message = Vec::new();
    decompressed(Box::new(Cursor::new(payload.to_vec())))
        .and_then(|text| text.take(longest + 1).read_to_end(&mut message))
        .map_err(|error| format!("cannot be decompressed: {error}"))?;
    if message.len() as u64 > longest {
        return Err(format!("is longer than {longest} bytes when it is decompressed"));
    }
    Ok(Cow::Owned(message))
}

/// Decompresses a message and reads its encoding; the error is half a sentence.
pub(super) fn content(payload: &[u8]) -> Result<Content<'_>, String> {
    let message = decompressed_message(payload, LONGEST_MESSAGE)?;
    let Some((encoding, _)) = message.split_at_checked(ENCODING) else {
        return Err(format!("{} bytes are too short for a message", message.len()));
    };
    let order = match encoding[..2] {
        [0, 0] => Order::Big,
        [0, 1] => Order::Little,
        _ => {
            return Err(format!(
                "it is encoded as 0x{:02x}{:02x}, not in plain CDR (0x0000 or 0x0001)",
                encoding[0], encoding[1]
            ));
        }
    };
    let bytes = match message {
        Cow::Borrowed(message) => Cow::Borrowed(&message[ENCODING..]),
        Cow::Owned(message) => Cow::Owned(message[ENCODING..].to_vec()),
    };
    Ok(Content { order, bytes })
}

/// Reads a message; the error is half a sentence.
pub(super) fn decode<T: for<'de> Deserialize<'de>>(payload: &[u8]) -> Result<T, String> {
    let content = content(payload)?;
    let decoded = content.decode();
    let bytes = &content.bytes;
    let length = ENCODING + bytes.len();
    match decoded {
        Ok((message, used)) if bytes.len() - used <= LONGEST_PADDING => Ok(message),
        Ok((_, used)) => {
            Err(format!("{length} bytes are more than its type has, {}", ENCODING + used))
        }
        Err(cdr_encoding::Error::Eof) => Err(format!("{length} bytes are fewer than its type has")),
        Err(error) => Err(error.to_string()),
    }
}

/// Reads the first fields of a message, whatever follows; the error is half a sentence.
pub(super) fn decode_start<T: for<'de> Deserialize<'de>>(payload: &[u8]) -> Result<T, String> {
    let decoded = content(payload)?.decode();
    decoded.map(|(start, _)| start).map_err(|error| error.to_string())
}
