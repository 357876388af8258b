//! The SDO server: reads and writes objects over CAN (CiA 301, 7.2.4), expedited and segmented.
//!
//! Requests arrive on 0x600 + node id, and responses are sent on 0x580 + node id. Both have eight bytes.
//!
//! | bytes | field |
//! |---|---|
//! | 0 | command specifier and flags |
//! | 1, 2 | index |
//! | 3 | sub-index |
//! | 4 to 7 | data, size or abort code |

use crate::abort::AbortCode;
use crate::address::Address;
use crate::value::Value;

/// The objects behind the server.
pub trait Objects {
    /// Reads an object.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    fn read(&mut self, address: Address) -> Result<Value, AbortCode>;

    /// Size of a writable number, bytes.
    ///
    /// # Errors
    /// The reason why it cannot be written.
    fn writable_size(&mut self, address: Address) -> Result<usize, AbortCode>;

    /// Writes an object.
    ///
    /// # Errors
    /// The reason why the value was refused.
    fn write(&mut self, address: Address, bytes: &[u8]) -> Result<WriteOutcome, AbortCode>;
}

/// Result of a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteOutcome {
    /// Completed.
    Done,
    /// In progress: [`SdoServer::finish`] answers when it has completed.
    Pending,
}

/// Size of the largest writable value, a number, bytes.
const LARGEST: usize = 4;

/// Data bytes of a segment.
const SEGMENT: usize = 7;

#[derive(Clone, Copy, Debug)]
enum Transfer {
    Upload {
        address: Address,
        text: &'static str,
        sent: usize,
        toggle: bool,
    },
    Download {
        address: Address,
        data: [u8; LARGEST],
        received: usize,
        declared: Option<usize>,
        toggle: bool,
    },
    /// A write is pending. This is the response once it has completed.
    Pending {
        address: Address,
        answer: [u8; 8],
    },
}

/// SDO server: its state, with at most one transfer.
#[derive(Clone, Debug, Default)]
pub struct SdoServer {
    transfer: Option<Transfer>,
}

const TOGGLE: u8 = 1 << 4;

impl SdoServer {
    /// Creates a server without a transfer.
    #[must_use]
    pub const fn new() -> Self {
        Self { transfer: None }
    }

    /// Handles a request. Returns `None` if there is no response, or not yet.
    pub fn handle(&mut self, request: &[u8; 8], objects: &mut impl Objects) -> Option<[u8; 8]> {
        let [command, index_low, index_high, subindex, data @ ..] = *request;
        let address = Address::new(u16::from_le_bytes([index_low, index_high]), subindex);
        // A new request ends any previous transfer. Segments continue it.
        let transfer = self.transfer.take();
        match command >> 5 {
            0 => {
                let [_, segment @ ..] = *request;
                self.download_segment(command, segment, transfer, objects)
            }
            1 => self.download(command, address, data, objects),
            2 => Some(self.upload(address, objects)),
            3 => Some(self.upload_segment(command, transfer)),
            // Abort by the client.
            4 => None,
            _ => Some(abort(address, AbortCode::Command)),
        }
    }

    /// Answers the write that was [pending](WriteOutcome::Pending).
    pub fn finish(&mut self, result: Result<(), AbortCode>) -> Option<[u8; 8]> {
        match self.transfer.take() {
            Some(Transfer::Pending { address, answer }) => Some(match result {
                Ok(()) => answer,
                Err(code) => abort(address, code),
            }),
            other => {
                self.transfer = other;
                None
            }
        }
    }

    fn upload(&mut self, address: Address, objects: &mut impl Objects) -> [u8; 8] {
        match objects.read(address) {
            Ok(Value::Text(text)) => {
                self.transfer = Some(Transfer::Upload { address, text, sent: 0, toggle: false });
                // Segmented, size indicated.
                response(0x41, address, (text.len() as u32).to_le_bytes())
            }
            Ok(number) => {
                let size = number.data_type().size().unwrap_or(LARGEST);
                // Expedited. The size is indicated as the number of unused bytes.
                let unused = LARGEST.saturating_sub(size) as u8;
                response(0x43 | unused << 2, address, number.to_raw().to_le_bytes())
            }
            Err(code) => abort(address, code),
        }
    }

    fn upload_segment(&mut self, command: u8, transfer: Option<Transfer>) -> [u8; 8] {
        let Some(Transfer::Upload { address, text, sent, toggle }) = transfer else {
            return abort(Address::new(0, 0), AbortCode::Command);
        };
        if (command & TOGGLE != 0) != toggle {
            return abort(address, AbortCode::ToggleBit);
        }
        let rest = text.as_bytes().get(sent..).unwrap_or(&[]);
        let length = rest.len().min(SEGMENT);
        let last = rest.len() <= SEGMENT;
        let mut answer = [0; 8];
        let [head, data @ ..] = &mut answer;
        *head = u8::from(toggle) << 4 | ((SEGMENT - length) as u8) << 1 | u8::from(last);
        for (to, from) in data.iter_mut().zip(rest) {
            *to = *from;
        }
        if !last {
            self.transfer =
                Some(Transfer::Upload { address, text, sent: sent + length, toggle: !toggle });
        }
        answer
    }

    fn download(
        &mut self,
        command: u8,
        address: Address,
        data: [u8; 4],
        objects: &mut impl Objects,
    ) -> Option<[u8; 8]> {
        let (expedited, sized) = (command & 0b10 != 0, command & 0b01 != 0);
        let size = match objects.writable_size(address) {
            Ok(size) => size,
            Err(code) => return Some(abort(address, code)),
        };
        if expedited {
            let length = if sized { LARGEST - usize::from(command >> 2 & 0b11) } else { size };
            let bytes = data.get(..length).unwrap_or(&data);
            return self.write(address, bytes, size, written(address), objects);
        }
        let declared = sized.then(|| u32::from_le_bytes(data) as usize);
        if let Some(code) = declared.and_then(|length| wrong_length(length, size)) {
            return Some(abort(address, code));
        }
        self.transfer = Some(Transfer::Download {
            address,
            data: [0; LARGEST],
            received: 0,
            declared,
            toggle: false,
        });
        Some(written(address))
    }

    fn download_segment(
        &mut self,
        command: u8,
        segment: [u8; SEGMENT],
        transfer: Option<Transfer>,
        objects: &mut impl Objects,
    ) -> Option<[u8; 8]> {
        let Some(Transfer::Download { address, mut data, mut received, declared, toggle }) =
            transfer
        else {
            return Some(abort(Address::new(0, 0), AbortCode::Command));
        };
        if (command & TOGGLE != 0) != toggle {
            return Some(abort(address, AbortCode::ToggleBit));
        }
        let length = SEGMENT - usize::from(command >> 1 & 0b111);
        for &byte in segment.iter().take(length) {
            match data.get_mut(received) {
                Some(next) => *next = byte,
                None => return Some(abort(address, AbortCode::TooLong)),
            }
            received += 1;
        }
        let mut answer = [0; 8];
        let [head, ..] = &mut answer;
        *head = 0x20 | u8::from(toggle) << 4;
        if command & 1 == 0 {
            self.transfer =
                Some(Transfer::Download { address, data, received, declared, toggle: !toggle });
            return Some(answer);
        }
        if declared.is_some_and(|declared| declared != received) {
            return Some(abort(address, AbortCode::Length));
        }
        match objects.writable_size(address) {
            Ok(size) => {
                let bytes = data.get(..received).unwrap_or(&data);
                self.write(address, bytes, size, answer, objects)
            }
            Err(code) => Some(abort(address, code)),
        }
    }

    fn write(
        &mut self,
        address: Address,
        bytes: &[u8],
        size: usize,
        answer: [u8; 8],
        objects: &mut impl Objects,
    ) -> Option<[u8; 8]> {
        if let Some(code) = wrong_length(bytes.len(), size) {
            return Some(abort(address, code));
        }
        match objects.write(address, bytes) {
            Ok(WriteOutcome::Done) => Some(answer),
            Ok(WriteOutcome::Pending) => {
                self.transfer = Some(Transfer::Pending { address, answer });
                None
            }
            Err(code) => Some(abort(address, code)),
        }
    }
}

/// Abort code if a value of `length` bytes does not fit an object of `size` bytes.
pub(crate) fn wrong_length(length: usize, size: usize) -> Option<AbortCode> {
    use core::cmp::Ordering::{Equal, Greater, Less};
    match length.cmp(&size) {
        Equal => None,
        Greater => Some(AbortCode::TooLong),
        Less => Some(AbortCode::TooShort),
    }
}

/// The answer to a write that was done.
#[must_use]
pub fn written(address: Address) -> [u8; 8] {
    response(0x60, address, [0; 4])
}

pub(crate) fn response(command: u8, address: Address, [a, b, c, d]: [u8; 4]) -> [u8; 8] {
    let [low, high] = address.index.to_le_bytes();
    [command, low, high, address.subindex, a, b, c, d]
}

pub(crate) fn abort(address: Address, code: AbortCode) -> [u8; 8] {
    response(0x80, address, code.code().to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One number at 0x2000, one text at 0x1008.
    struct Two(u32);

    impl Objects for Two {
        fn read(&mut self, address: Address) -> Result<Value, AbortCode> {
            match address.index {
                0x2000 => Ok(Value::U32(self.0)),
                0x2001 => Ok(Value::U8(7)),
                0x1008 => Ok(Value::Text("nine bytes, and more")),
                _ => Err(AbortCode::NoObject),
            }
        }

        fn writable_size(&mut self, address: Address) -> Result<usize, AbortCode> {
            match address.index {
                0x2000 => Ok(4),
                0x2001 => Ok(1),
                0x1008 => Err(AbortCode::ReadOnly),
                _ => Err(AbortCode::NoObject),
            }
        }

        fn write(&mut self, _: Address, bytes: &[u8]) -> Result<WriteOutcome, AbortCode> {
            self.0 = bytes.iter().rev().fold(0, |n, b| n << 8 | u32::from(*b));
            if self.0 == 99 {
                return Ok(WriteOutcome::Pending);
            }
            Ok(WriteOutcome::Done)
        }
    }

    fn exchange(requests: &[[u8; 8]]) -> (std::vec::Vec<Option<[u8; 8]>>, u32) {
        let (mut server, mut objects) = (SdoServer::new(), Two(0x1234_5678));
        let answers = requests.iter().map(|request| server.handle(request, &mut objects)).collect();
        (answers, objects.0)
    }

    #[test]
    fn golden_bytes_of_expedited_transfers() {
        let (answers, _) = exchange(&[
            [0x40, 0x00, 0x20, 0, 0, 0, 0, 0],
            [0x40, 0x01, 0x20, 0, 0, 0, 0, 0],
            [0x40, 0xFF, 0x20, 3, 0, 0, 0, 0],
        ]);
        assert_eq!(
            answers,
            [
                Some([0x43, 0x00, 0x20, 0, 0x78, 0x56, 0x34, 0x12]),
                Some([0x4F, 0x01, 0x20, 0, 7, 0, 0, 0]),
                Some([0x80, 0xFF, 0x20, 3, 0x00, 0x00, 0x02, 0x06]),
            ]
        );
        let (answers, value) = exchange(&[[0x23, 0x00, 0x20, 0, 1, 2, 3, 4]]);
        assert_eq!(answers, [Some([0x60, 0x00, 0x20, 0, 0, 0, 0, 0])]);
        assert_eq!(value, 0x0403_0201);
        // Without a size in the request, the size of the object applies.
        let (answers, value) = exchange(&[[0x22, 0x01, 0x20, 0, 5, 9, 9, 9]]);
        assert_eq!(answers, [Some([0x60, 0x01, 0x20, 0, 0, 0, 0, 0])]);
        assert_eq!(value, 5);
    }

    #[test]
    fn a_text_is_read_in_segments() {
        let (answers, _) = exchange(&[
            [0x40, 0x08, 0x10, 0, 0, 0, 0, 0],
            [0x60, 0, 0, 0, 0, 0, 0, 0],
            [0x70, 0, 0, 0, 0, 0, 0, 0],
            [0x60, 0, 0, 0, 0, 0, 0, 0],
            [0x70, 0, 0, 0, 0, 0, 0, 0],
        ]);
        assert_eq!(
            answers,
            [
                Some([0x41, 0x08, 0x10, 0, 20, 0, 0, 0]),
                Some(*b"\x00nine by"),
                Some(*b"\x10tes, an"),
                Some(*b"\x03d more\0"),
                Some([0x80, 0, 0, 0, 1, 0, 4, 5]),
            ]
        );
    }

    #[test]
    fn a_number_is_written_in_segments() {
        let (answers, value) = exchange(&[
            [0x21, 0x00, 0x20, 0, 4, 0, 0, 0],
            [0b0000_1010, 1, 2, 0, 0, 0, 0, 0],
            [0b0001_1011, 3, 4, 0, 0, 0, 0, 0],
        ]);
        assert_eq!(
            answers,
            [
                Some([0x60, 0x00, 0x20, 0, 0, 0, 0, 0]),
                Some([0x20, 0, 0, 0, 0, 0, 0, 0]),
                Some([0x30, 0, 0, 0, 0, 0, 0, 0]),
            ]
        );
        assert_eq!(value, 0x0403_0201);
    }

    #[test]
    fn invalid_requests_are_refused_with_the_reason() {
        let refused = |requests: &[[u8; 8]]| {
            let (answers, value) = exchange(requests);
            assert_eq!(value, 0x1234_5678);
            let answer = answers.last().copied().flatten().expect("an answer");
            assert_eq!(answer[0], 0x80);
            let [.., a, b, c, d] = answer;
            AbortCode::from_code(u32::from_le_bytes([a, b, c, d])).expect("a known code")
        };
        // Downloads of a wrong length: two bytes for one, one for four, and a declared size of five.
        let two = [0x2B, 0x01, 0x20, 0, 1, 2, 0, 0];
        assert_eq!(refused(&[two]), AbortCode::TooLong);
        let one = [0x2F, 0x00, 0x20, 0, 1, 0, 0, 0];
        assert_eq!(refused(&[one]), AbortCode::TooShort);
        let five = [0x21, 0x00, 0x20, 0, 5, 0, 0, 0];
        assert_eq!(refused(&[five]), AbortCode::TooLong);
        // Seven bytes without a declared size.
        let unsized_ = [0x20, 0x00, 0x20, 0, 0, 0, 0, 0];
        let seven = [0x01, 1, 2, 3, 4, 5, 6, 7];
        assert_eq!(refused(&[unsized_, seven]), AbortCode::TooLong);
        // A number of bytes that differs from the declared size.
        let four = [0x21, 0x00, 0x20, 0, 4, 0, 0, 0];
        let three = [0b0000_1001, 1, 2, 3, 0, 0, 0, 0];
        assert_eq!(refused(&[four, three]), AbortCode::Length);
        // Requests that are refused: a wrong toggle bit, a segment without a transfer, a block transfer, a read-only name.
        let toggled = [0x11, 1, 2, 3, 4, 0, 0, 0];
        assert_eq!(refused(&[unsized_, toggled]), AbortCode::ToggleBit);
        assert_eq!(refused(&[seven]), AbortCode::Command);
        assert_eq!(refused(&[[0xA4, 0x00, 0x20, 0, 0, 0, 0, 0]]), AbortCode::Command);
        let name = [0x23, 0x08, 0x10, 0, 1, 2, 3, 4];
        assert_eq!(refused(&[name]), AbortCode::ReadOnly);
    }

    #[test]
    fn a_pending_write_is_answered_by_finish() {
        let (mut server, mut objects) = (SdoServer::new(), Two(0));
        let request = [0x23, 0x00, 0x20, 0, 99, 0, 0, 0];
        for (result, answer) in [
            (Ok(()), [0x60, 0x00, 0x20, 0, 0, 0, 0, 0]),
            (Err(AbortCode::Hardware), [0x80, 0x00, 0x20, 0, 0, 0, 6, 6]),
        ] {
            assert_eq!(server.handle(&request, &mut objects), None);
            assert_eq!(server.finish(result), Some(answer));
            assert_eq!(server.finish(result), None);
        }
    }
}
