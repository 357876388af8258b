//! The SDO server for objects of any length: segmented and block download into a domain (CiA 301, 7.2.4.3).
//!
//! A segment carries seven bytes. In a block download, one response confirms a sub-block of up to 127 segments. The
//! response contains the number of the last segment in sequence, and the client repeats the segments after it. Bytes
//! are stored at the end of each sub-block, when no frame is on its way.
//!
//! [`SdoServer`] provides all other services.

use crc::{CRC_16_XMODEM, Crc, Digest};

use crate::abort::AbortCode;
use crate::address::Address;
use crate::sdo::{Objects, SdoServer, abort, response, written};

/// Data bytes of a segment.
const SEGMENT: usize = 7;

const TOGGLE: u8 = 1 << 4;

/// Bit of a segment's number, or of a segment's command: no more segments follow.
const LAST_OF_BLOCK: u8 = 1 << 7;
const LAST: u8 = 1;

/// Bits of the request and of the response of a block download: CRC, and size indicated.
const CRC: u8 = 1 << 2;
const SIZED: u8 = 1 << 1;

static CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// Objects, some of which are domains.
pub trait Domains: Objects {
    /// Number of segments that can be taken before [`flush`](Self::flush), 1 to 127.
    const BLOCK: u8;

    /// Returns whether an object is a domain.
    fn is_domain(&self, address: Address) -> bool;

    /// Begins a download of `size` bytes, if the client indicates the size. Discards an unfinished download.
    ///
    /// # Errors
    /// The reason for refusing the download.
    fn begin(&mut self, address: Address, size: Option<u32>) -> Result<(), AbortCode>;

    /// Takes the next bytes, at most seven.
    ///
    /// # Errors
    /// The reason for ending the download.
    fn append(&mut self, bytes: &[u8]) -> Result<(), AbortCode>;

    /// Stores the bytes taken.
    ///
    /// # Errors
    /// The reason for ending the download.
    fn flush(&mut self) -> Result<(), AbortCode>;

    /// Ends the download.
    ///
    /// # Errors
    /// The reason for refusing its bytes.
    fn end(&mut self) -> Result<(), AbortCode>;
}

/// Part of a download.
#[derive(Clone)]
enum Phase {
    /// Segmented, with the toggle bit of the next segment.
    Segments { toggle: bool },
    /// Within a sub-block: number of the last segment in sequence, 0 before the first.
    Block { sequence: u8, state: Block },
    /// All segments have arrived, and the client's next request gives the length of the last one.
    End(Block),
}

/// State of a block download.
#[derive(Clone)]
struct Block {
    /// CRC of the bytes so far, if the client sends one.
    check: Option<Digest<'static, u16>>,
    /// Segment that may be the last one, whose length is then still unknown.
    held: Option<[u8; SEGMENT]>,
}

#[derive(Clone)]
struct Transfer {
    address: Address,
    size: Option<u32>,
    received: u32,
    /// Last segment of the sub-block that was answered, to recognise it if CAN delivers the frame twice.
    answered: Option<[u8; 8]>,
    phase: Phase,
}

/// SDO server with domains: its state, with at most one transfer.
#[derive(Clone, Default)]
pub struct DomainServer {
    others: SdoServer,
    transfer: Option<Transfer>,
}

impl core::fmt::Debug for DomainServer {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("DomainServer")
            .field("others", &self.others)
            .field("is_receiving", &self.transfer.is_some())
            .finish_non_exhaustive()
    }
}

impl DomainServer {
    /// Creates a server without a transfer.
    #[must_use]
    pub const fn new() -> Self {
        Self { others: SdoServer::new(), transfer: None }
    }

    /// Handles a request. Returns `None` if there is no response, or not yet.
    pub fn handle<D: Domains>(&mut self, request: &[u8; 8], objects: &mut D) -> Option<[u8; 8]> {
        const ABORT: u8 = 0x80;
        let [command, low, high, subindex, rest @ ..] = *request;
        let [_, segment @ ..] = *request;
        let address = Address::new(u16::from_le_bytes([low, high]), subindex);
        // Any other request discards the transfer.
        match self.transfer.take() {
            Some(transfer) if command != ABORT => match transfer.phase {
                // The request that ends a download may equal the last segment, which CAN may deliver twice.
                Phase::End(ref state)
                    if state.ends_with(request)
                        && (transfer.answered != Some(*request) || is_blank(request)) =>
                {
                    return Some(transfer.end_block(state.last(command), objects));
                }
                _ if transfer.answered == Some(*request) => {
                    self.transfer = Some(transfer);
                    return None;
                }
                Phase::Block { sequence, ref state } => {
                    let state = state.clone();
                    return self.block(transfer, sequence, state, request, objects);
                }
                Phase::End(_) if command >> 5 == 6 && command & LAST != 0 => {
                    return Some(abort(transfer.address, AbortCode::Crc));
                }
                Phase::Segments { toggle } if command >> 5 == 0 => {
                    return Some(self.segment(transfer, toggle, command, segment, objects));
                }
                _ => {}
            },
            _ => {}
        }
        match command >> 5 {
            1 if command & 0b10 == 0 && objects.is_domain(address) => {
                let size = (command & LAST != 0).then_some(u32::from_le_bytes(rest));
                let phase = Phase::Segments { toggle: false };
                Some(self.begin(address, size, phase, written(address), objects))
            }
            6 if command & LAST == 0 && objects.is_domain(address) => {
                let size = (command & SIZED != 0).then_some(u32::from_le_bytes(rest));
                let check = (command & CRC != 0).then(|| CHECK.digest());
                let state = Block { check, held: None };
                let phase = Phase::Block { sequence: 0, state };
                let answer = response(0xA0 | CRC, address, [D::BLOCK, 0, 0, 0]);
                Some(self.begin(address, size, phase, answer, objects))
            }
            _ => self.others.handle(request, objects),
        }
    }

    /// Discards a download whose client is silent. Returns whether there was one.
    pub fn give_up(&mut self) -> bool {
        self.transfer.take().is_some()
    }

    fn begin(
        &mut self,
        address: Address,
        size: Option<u32>,
        phase: Phase,
        answer: [u8; 8],
        objects: &mut impl Domains,
    ) -> [u8; 8] {
        if let Err(code) = objects.begin(address, size) {
            return abort(address, code);
        }
        self.transfer = Some(Transfer { address, size, received: 0, answered: None, phase });
        answer
    }

    fn segment(
        &mut self,
        mut transfer: Transfer,
        toggle: bool,
        command: u8,
        segment: [u8; SEGMENT],
        objects: &mut impl Domains,
    ) -> [u8; 8] {
        let address = transfer.address;
        if (command & TOGGLE != 0) != toggle {
            return abort(address, AbortCode::ToggleBit);
        }
        let length = SEGMENT - usize::from(command >> 1 & 0b111);
        let bytes = segment.get(..length).unwrap_or(&segment);
        let taken = transfer.take(bytes, objects);
        let is_last = command & LAST != 0;
        let stored =
            taken.and_then(|()| if is_last { transfer.end(objects) } else { objects.flush() });
        if let Err(code) = stored {
            return abort(address, code);
        }
        if !is_last {
            transfer.phase = Phase::Segments { toggle: !toggle };
            self.transfer = Some(transfer);
        }
        [0x20 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0]
    }

    /// Takes a segment of a sub-block. Answers the last one.
    fn block<D: Domains>(
        &mut self,
        mut transfer: Transfer,
        mut sequence: u8,
        mut state: Block,
        request: &[u8; 8],
        objects: &mut D,
    ) -> Option<[u8; 8]> {
        let [command, segment @ ..] = *request;
        let (number, is_last) = (command & !LAST_OF_BLOCK, command & LAST_OF_BLOCK != 0);
        if number == 0 || number > D::BLOCK {
            return Some(abort(transfer.address, AbortCode::SequenceNumber));
        }
        transfer.answered = None;
        let in_sequence = number == sequence.wrapping_add(1);
        if in_sequence {
            sequence = number;
            if let Some(before) = state.held.replace(segment) {
                if let Some(check) = &mut state.check {
                    check.update(&before);
                }
                if let Err(code) = transfer.take(&before, objects) {
                    return Some(abort(transfer.address, code));
                }
            }
        }
        if !is_last && number < D::BLOCK {
            transfer.phase = Phase::Block { sequence, state };
            self.transfer = Some(transfer);
            return None;
        }
        if let Err(code) = objects.flush() {
            return Some(abort(transfer.address, code));
        }
        transfer.phase = if is_last && in_sequence {
            Phase::End(state)
        } else {
            Phase::Block { sequence: 0, state }
        };
        transfer.answered = Some(*request);
        self.transfer = Some(transfer);
        Some([0xA2, sequence, D::BLOCK, 0, 0, 0, 0, 0])
    }
}

/// Returns whether the reserved bytes of the end of a block download are zero.
fn is_blank(request: &[u8; 8]) -> bool {
    let [_, _, _, reserved @ ..] = *request;
    reserved == [0; 5]
}

impl Block {
    /// Bytes of the last segment, by the command that ends the download.
    fn last(&self, command: u8) -> &[u8] {
        let length = SEGMENT.saturating_sub(usize::from(command >> 2 & 0b111));
        let held = self.held.as_ref().map_or(&[] as &[u8], |held| held);
        held.get(..length).unwrap_or(held)
    }

    /// Returns whether a request ends the download, with the CRC of its bytes.
    fn ends_with(&self, request: &[u8; 8]) -> bool {
        let [command, low, high, ..] = *request;
        let matches = || match self.check.clone() {
            Some(mut check) => {
                check.update(self.last(command));
                check.finalize() == u16::from_le_bytes([low, high])
            }
            None => true,
        };
        command >> 5 == 6 && command & LAST != 0 && matches()
    }
}

impl Transfer {
    /// Passes bytes on, up to the size that the client has indicated.
    fn take(&mut self, bytes: &[u8], objects: &mut impl Domains) -> Result<(), AbortCode> {
        self.received = self.received.saturating_add(bytes.len() as u32);
        if self.size.is_some_and(|size| self.received > size) {
            return Err(AbortCode::TooLong);
        }
        objects.append(bytes)
    }

    /// Ends a block download whose last segment has these bytes.
    fn end_block(&self, last: &[u8], objects: &mut impl Domains) -> [u8; 8] {
        let mut transfer = self.clone();
        let taken = transfer.take(last, objects);
        match taken.and_then(|()| transfer.end(objects)) {
            Ok(()) => [0xA1, 0, 0, 0, 0, 0, 0, 0],
            Err(code) => abort(self.address, code),
        }
    }

    fn end(&self, objects: &mut impl Domains) -> Result<(), AbortCode> {
        if self.size.is_some_and(|size| self.received < size) {
            return Err(AbortCode::TooShort);
        }
        objects.flush()?;
        objects.end()
    }
}
