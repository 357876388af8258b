//! A stored message of ROS 2: CDR in either byte order, optionally compressed.
//!
//! The first four bytes give the encoding of the rest (DDSI-RTPS 2.5, section 10.5): 0 and 1 are plain CDR, big
//! and little endian. rosbag2 may compress each message with zstd; plain ones begin with a zero.

use std::fmt;
use std::io::{Cursor, Read};

use byteorder::{BigEndian, LittleEndian};
use cdr_encoding::from_bytes;
use serde::Deserialize;
use serde::de::{Deserializer, Visitor};

use super::super::compressed::{ZSTD, decompressed};

/// Longest message after decompression, bytes.
const LONGEST_MESSAGE: u64 = 1 << 20;

/// Length of the encoding header, bytes.
const ENCODING: usize = 4;

/// Most bytes that may follow a message: padding to a multiple of four.
const LONGEST_PADDING: usize = 3;

/// Reads a message; the error is half a sentence.
pub(super) fn decode<T: for<'de> Deserialize<'de>>(payload: &[u8]) -> Result<T, String> {
    if payload.starts_with(&ZSTD) {
        let mut message = Vec::new();
        decompressed(Box::new(Cursor::new(payload.to_vec())))
            .and_then(|text| text.take(LONGEST_MESSAGE).read_to_end(&mut message))
            .map_err(|error| format!("cannot be decompressed: {error}"))?;
        return plain(&message);
    }
    plain(payload)
}

fn plain<T: for<'de> Deserialize<'de>>(payload: &[u8]) -> Result<T, String> {
    let Some((encoding, content)) = payload.split_at_checked(ENCODING) else {
        return Err(format!("{} bytes are no message", payload.len()));
    };
    let decoded = match encoding[..2] {
        [0, 0] => from_bytes::<T, BigEndian>(content),
        [0, 1] => from_bytes::<T, LittleEndian>(content),
        _ => {
            return Err(format!(
                "it is encoded as 0x{:02x}{:02x}, not in plain CDR (0x0000 or 0x0001)",
                encoding[0], encoding[1]
            ));
        }
    };
    match decoded {
        Ok((message, used)) if content.len() - used <= LONGEST_PADDING => Ok(message),
        Ok((_, used)) => Err(format!(
            "{} bytes are more than its type has, {}",
            payload.len(),
            ENCODING + used
        )),
        Err(cdr_encoding::Error::Eof) => Err(format!(
            "{} bytes are fewer than its type has",
            payload.len()
        )),
        Err(error) => Err(error.to_string()),
    }
}

/// A text that is skipped, whatever its content: in CDR it is a byte count followed by the bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Skipped;

/// A text, whatever its content; bytes that are not UTF-8 are replaced.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Text(pub(super) String);

impl<'de> Deserialize<'de> for Skipped {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_bytes(Bytes(|_: &[u8]| Skipped))
    }
}

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_bytes(Bytes(|bytes: &[u8]| {
            let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
            Text(String::from_utf8_lossy(text).into_owned())
        }))
    }
}

/// Visitor that makes a value of the bytes of a text.
struct Bytes<F>(F);

impl<T, F: FnOnce(&[u8]) -> T> Visitor<'_> for Bytes<F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_bytes<E>(self, bytes: &[u8]) -> Result<T, E> {
        Ok((self.0)(bytes))
    }
}
