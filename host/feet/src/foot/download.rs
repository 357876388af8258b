//! Bytes of any length, such as a program, that a foot receives over CAN: block download of `CiA` 301 (7.2.4.3.9).

use std::time::Duration;

use crc::{CRC_16_XMODEM, Crc};
use wire::{Address, NodeId};

use super::client::Client;
use super::request::{FootRequest, RequestError, TRIES};

/// Response timeout of a sub-block and of the end. The foot stores and checks the bytes before it responds.
const STORED: Duration = Duration::from_secs(3);

/// Data bytes of a segment.
const SEGMENT: usize = 7;

/// Largest number of segments in a sub-block.
const LARGEST_BLOCK: u8 = 127;

/// Writes bytes of any length to an object of a node, with a CRC. `sent` is
/// called with the number of bytes that have arrived.
///
/// # Errors
/// The download is refused, or a response is missing. In the latter case the download is aborted.
pub(super) fn download(
    client: &mut Client,
    node: NodeId,
    address: Address,
    bytes: &[u8],
    sent: &mut dyn FnMut(usize),
) -> Result<(), RequestError> {
    let request = FootRequest::Download { address, bytes: bytes.len() };
    match send_blocks(client, node, address, bytes, sent) {
        Ok(()) => Ok(()),
        Err(Ended::Aborted(code)) => Err(RequestError::refused(request, code)),
        Err(Ended::Failed(error)) => Err(error),
        Err(Ended::Silent) => {
            client.abort(node, address)?;
            Err(client.no_answer(request))
        }
    }
}

/// End of an attempt that did not transfer all bytes.
enum Ended {
    /// A response is missing, or not one of the protocol.
    Silent,
    /// Aborted by the node, with this code.
    Aborted(u32),
    Failed(RequestError),
}

impl From<RequestError> for Ended {
    fn from(error: RequestError) -> Self {
        Self::Failed(error)
    }
}

fn send_blocks(
    client: &mut Client,
    node: NodeId,
    address: Address,
    bytes: &[u8],
    sent: &mut dyn FnMut(usize),
) -> Result<(), Ended> {
    let [low, high] = address.index.to_le_bytes();
    let [a, b, c, d] = (bytes.len() as u32).to_le_bytes();
    // With CRC, and the size.
    let begin = [0xC6, low, high, address.subindex, a, b, c, d];
    let answer = exchange(client, node, begin, |head| head >> 5 == 5)?;
    let [head, _, _, _, mut size, ..] = answer;
    let has_crc = head & 0b100 != 0;
    let segments: Vec<&[u8]> = bytes.chunks(SEGMENT).collect();
    let (mut done, mut fruitless) = (0, 0);
    while done < segments.len() {
        if size == 0 || size > LARGEST_BLOCK || fruitless == TRIES {
            return Err(Ended::Silent);
        }
        let block = segments.iter().enumerate().skip(done);
        let mut last = None;
        for ((index, segment), number) in block.zip(1..=size) {
            if let Some(request) = last.take() {
                client.send_sdo(node, request)?;
            }
            let is_last = index + 1 == segments.len();
            let mut request = [number | u8::from(is_last) << 7, 0, 0, 0, 0, 0, 0, 0];
            request[1..=segment.len()].copy_from_slice(segment);
            last = Some(request);
        }
        let last = last.ok_or(Ended::Silent)?;
        let answer = exchange(client, node, last, |head| head == 0xA2)?;
        let [_, taken, next, ..] = answer;
        if taken > size {
            return Err(Ended::Silent);
        }
        fruitless = if taken == 0 { fruitless + 1 } else { 0 };
        done += usize::from(taken);
        size = next;
        sent((done * SEGMENT).min(bytes.len()));
    }
    let unused = segments.last().map_or(0, |last| SEGMENT - last.len()) as u8;
    let crc = if has_crc { Crc::<u16>::new(&CRC_16_XMODEM).checksum(bytes) } else { 0 };
    let [low, high] = crc.to_le_bytes();
    let end = [0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0];
    exchange(client, node, end, |head| head == 0xA1).map(|_| ())
}

/// Sends a request and returns its response, whose first byte satisfies `is_expected`.
fn exchange(
    client: &mut Client,
    node: NodeId,
    request: [u8; 8],
    is_expected: fn(u8) -> bool,
) -> Result<[u8; 8], Ended> {
    const ABORT: u8 = 0x80;
    let answer = client
        .exchange(node, request, STORED, |[head, ..]| *head == ABORT || is_expected(*head))?;
    match answer.ok_or(Ended::Silent)? {
        [ABORT, _, _, _, code @ ..] => Err(Ended::Aborted(u32::from_le_bytes(code))),
        answer => Ok(answer),
    }
}
