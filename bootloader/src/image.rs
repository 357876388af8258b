//! The header in front of a program. It has 512 bytes, so that the vector table behind it is aligned as required.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 7 | `FOOTFALL` |
//! | 8 | version of this format: 1 |
//! | 9 | [`Kind`] |
//! | 10, 11 | [`Board`] |
//! | 12 to 15 | length of the program behind the header, bytes: a multiple of 4 |
//! | 16 to 19 | sequence: time of the commit, s since 1970; an update never lowers it |
//! | 20 to 22 | version: major, minor, patch |
//! | 23 | 1 if the sources differed from the commit, otherwise 0 |
//! | 24 to 43 | commit, 20 bytes |
//! | 44 to 75 | SHA-256 of the program, followed by bytes 0 to 43 |
//! | 76 to 139 | Ed25519 signature of bytes 0 to 75 |
//! | 508 to 511 | 0xFF in an image; [mark](MARK) of a confirmed program in the running slot |
//!
//! Integers are little-endian. The signature covers the hash, and so the program. The hash of a running program is
//! checked, which also detects a changed bit of the header. Bytes 76 to 139 are used only before an install.

use crate::flash::{Flash, SLOT_SIZE, Slot};

/// Size of the header, bytes.
pub const HEADER: usize = 512;

/// Number of bytes of the header, from the first, that are hashed behind the program.
pub const HASHED: usize = 44;

/// Number of bytes that are signed, from the first.
pub const SIGNED: usize = 76;

/// Number of bytes in use. The others have the value of erased flash.
pub const USED: usize = 140;

/// Offset in the header of the mark of a confirmed program: the last word. Only the bootloader writes it, in the
/// running slot. No copy has it.
pub const MARK: usize = HEADER - 4;

/// Bytes of a commit's hash.
pub const COMMIT: usize = 20;

/// Longest program, bytes.
pub const LONGEST: u32 = SLOT_SIZE - HEADER as u32;

/// Shortest program, bytes: its vector table.
pub const SHORTEST: u32 = 392;

const MAGIC: [u8; 8] = *b"FOOTFALL";
const FORMAT: u8 = 1;

/// Origin of a program on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Written by a debug probe, without hash and signature. Never accepted as an update.
    Probed,
    /// Sent as an image, with hash and signature.
    Signed,
}

/// Board for which a program is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// The reference board.
    Reference,
    /// Adafruit's Feather STM32F405 Express.
    Feather,
}

impl Board {
    /// All boards.
    pub const ALL: [Self; 2] = [Self::Reference, Self::Feather];

    /// Number in the header.
    #[must_use]
    pub const fn number(self) -> u16 {
        match self {
            Self::Reference => 1,
            Self::Feather => 2,
        }
    }

    /// Name of the board. Its folder and feature have the same name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Feather => "feather",
        }
    }
}

/// Contents of a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Origin of the program.
    pub kind: Kind,
    /// Board that the program is for.
    pub board: Board,
    /// Length of the program, bytes.
    pub length: u32,
    /// Time of the commit, s since 1970.
    pub sequence: u32,
    /// Version: major, minor, patch.
    pub version: [u8; 3],
    /// Whether the sources were those of the commit.
    pub sources: Sources,
    /// Commit.
    pub commit: [u8; COMMIT],
    /// SHA-256 of the program and of the fields before.
    pub hash: [u8; 32],
    /// Ed25519 signature.
    pub signature: [u8; 64],
}

/// State of the sources that a program was built from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sources {
    /// Sources of the commit.
    Committed,
    /// Changed after the commit.
    Changed,
}

/// Reason why a program is refused. The number is that of [`Refusal::number`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The bytes do not begin with a header.
    NotAnImage,
    /// The header has a format unknown to this bootloader.
    UnknownFormat,
    /// The program is for another board.
    OtherBoard,
    /// The program is empty, longer than the slot, or not a multiple of words, or its length differs from the announced
    /// one.
    WrongLength,
    /// The image has no signature.
    Unsigned,
    /// The signature was not made with the key of the bootloader.
    WrongSignature,
    /// The program is older than the running one.
    Older,
    /// Program and header do not match the hash in the header.
    WrongHash,
    /// The flash could not be written.
    FlashFailed,
    /// The slot was not cleared.
    NotCleared,
    /// The program was not confirmed in its first starts.
    NotConfirmed,
    /// The running program has decayed.
    Decayed,
}

/// Value of object 0x1F57 after a transfer that ended before the image was complete: by an abort, a timeout, or another
/// request. It is error 63 of CiA 302-3, unspecified, with the number after those of [`Refusal`], because the image was
/// not judged.
pub const BROKEN_OFF: u32 = 63 << 1 | (Refusal::ALL.len() as u32 + 1) << 16;

impl Refusal {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Self; 12] = [
        Self::NotAnImage,
        Self::UnknownFormat,
        Self::OtherBoard,
        Self::WrongLength,
        Self::Unsigned,
        Self::WrongSignature,
        Self::Older,
        Self::WrongHash,
        Self::FlashFailed,
        Self::NotCleared,
        Self::NotConfirmed,
        Self::Decayed,
    ];

    /// Number, from 1.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8 + 1
    }

    /// The reason with this number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        let index = usize::from(number).checked_sub(1)?;
        Self::ALL.get(index).copied()
    }

    /// Description for a person.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::NotAnImage => "the file is not an image of a foot's program",
            Self::UnknownFormat => "the image has a newer format than the bootloader knows",
            Self::OtherBoard => "the image is for another board",
            Self::WrongLength => "the image is shorter or longer than its header says",
            Self::Unsigned => "the image is not signed",
            Self::WrongSignature => "the image is signed with another key than the bootloader has",
            Self::Older => "the image is older than the program on the foot",
            Self::WrongHash => "the image is damaged: its hash differs from its header",
            Self::FlashFailed => "the foot's flash could not be written",
            Self::NotCleared => "the foot's slot for a new program was not cleared",
            Self::NotConfirmed => {
                "the new program has not confirmed that it works: the previous one is back, if there is one"
            }
            Self::Decayed => {
                "the program in the foot's flash has decayed: the previous one is back, if there is one"
            }
        }
    }

    /// Number of the error in CiA 302-3.
    const fn error(self) -> u8 {
        match self {
            Self::NotConfirmed | Self::Decayed => 1,
            Self::NotAnImage | Self::UnknownFormat => 2,
            Self::WrongLength | Self::WrongHash => 3,
            Self::NotCleared => 4,
            Self::FlashFailed => 5,
            Self::Unsigned | Self::WrongSignature => 7,
            Self::OtherBoard | Self::Older => 63,
        }
    }

    /// Value of object 0x1F57 (CiA 302-3): bit 0 in progress, bits 1 to 7 the error, bits 16 to 23 our number.
    #[must_use]
    pub const fn flash_status(self) -> u32 {
        (self.error() as u32) << 1 | (self.number() as u32) << 16
    }

    /// Reason in a value of object 0x1F57; `None` also for [`BROKEN_OFF`].
    #[must_use]
    pub fn from_flash_status(status: u32) -> Option<Self> {
        Self::from_number((status >> 16) as u8)
    }
}

impl Header {
    /// Number of the program for object 0x1F56: the first four bytes of its hash. Without a hash it is the first four
    /// bytes of its commit, so that the object shows the commit's first eight digits, or 0 if no commit has the
    /// sources.
    #[must_use]
    pub const fn identification(&self) -> u32 {
        let ([a, b, c, d, ..], [e, f, g, h, ..]) = (&self.hash, &self.commit);
        match (self.kind, self.sources) {
            (Kind::Signed, _) => u32::from_le_bytes([*a, *b, *c, *d]),
            (Kind::Probed, Sources::Committed) => u32::from_be_bytes([*e, *f, *g, *h]),
            (Kind::Probed, Sources::Changed) => 0,
        }
    }

    /// Header in these bytes.
    ///
    /// # Errors
    /// The bytes are not a header, or a value is outside its range.
    pub fn decode(bytes: &[u8; HEADER]) -> Result<Self, Refusal> {
        let mut rest = bytes.as_slice();
        if take(&mut rest) != MAGIC {
            return Err(Refusal::NotAnImage);
        }
        let [format, kind] = take(&mut rest);
        if format != FORMAT {
            return Err(Refusal::UnknownFormat);
        }
        let kind = match kind {
            0 => Kind::Probed,
            1 => Kind::Signed,
            _ => return Err(Refusal::UnknownFormat),
        };
        let number = u16::from_le_bytes(take(&mut rest));
        let board = Board::ALL
            .into_iter()
            .find(|board| board.number() == number)
            .ok_or(Refusal::OtherBoard)?;
        let length = u32::from_le_bytes(take(&mut rest));
        let sequence = u32::from_le_bytes(take(&mut rest));
        let version = take(&mut rest);
        let [changed] = take(&mut rest);
        let header = Self {
            kind,
            board,
            length,
            sequence,
            version,
            sources: if changed == 0 { Sources::Committed } else { Sources::Changed },
            commit: take(&mut rest),
            hash: take(&mut rest),
            signature: take(&mut rest),
        };
        // Bytes that the signature does not cover must be equal in all images of a program.
        let is_padded = bytes.iter().skip(USED).all(|byte| *byte == 0xFF);
        if kind == Kind::Signed && !is_padded {
            return Err(Refusal::NotAnImage);
        }
        let whole = length.is_multiple_of(4) && (SHORTEST..=LONGEST).contains(&length);
        if whole || kind == Kind::Probed { Ok(header) } else { Err(Refusal::WrongLength) }
    }

    /// Bytes of the header.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER] {
        let mut bytes = [0xFF; HEADER];
        let fields: [&[u8]; 10] = [
            &MAGIC,
            &[FORMAT, self.kind as u8],
            &self.board.number().to_le_bytes(),
            &self.length.to_le_bytes(),
            &self.sequence.to_le_bytes(),
            &self.version,
            &[self.sources as u8],
            &self.commit,
            &self.hash,
            &self.signature,
        ];
        let values = fields.into_iter().flatten();
        for (byte, value) in bytes.iter_mut().zip(values) {
            *byte = *value;
        }
        bytes
    }

    /// First bytes of the header of a program written by a probe, evaluated by the compiler. `commit` is that of the
    /// sources, hexadecimal; empty if no commit has them.
    #[must_use]
    #[allow(clippy::indexing_slicing)]
    pub const fn probed(board: Board, commit: &str) -> [u8; USED] {
        let mut bytes = [0xFF; USED];
        let mut at = 0;
        while at < MAGIC.len() {
            bytes[at] = MAGIC[at];
            at += 1;
        }
        bytes[8] = FORMAT;
        bytes[9] = Kind::Probed as u8;
        [bytes[10], bytes[11]] = board.number().to_le_bytes();
        // The bootloader does not know length, sequence and version.
        at = 12;
        while at < 23 {
            bytes[at] = 0;
            at += 1;
        }
        let digits = commit.as_bytes();
        let is_known = digits.len() == 2 * COMMIT;
        bytes[23] = if is_known { 0 } else { 1 };
        at = 0;
        while is_known && at < COMMIT {
            bytes[24 + at] = hexadecimal(digits[2 * at]) << 4 | hexadecimal(digits[2 * at + 1]);
            at += 1;
        }
        bytes
    }

    /// Checks whether the program may replace the running one on `board`. Does not check hash and signature.
    ///
    /// # Errors
    /// The reason why the program may not replace the running one.
    pub fn check(&self, board: Board, running: Option<&Self>) -> Result<(), Refusal> {
        if self.board != board {
            return Err(Refusal::OtherBoard);
        }
        if self.kind != Kind::Signed {
            return Err(Refusal::Unsigned);
        }
        match running {
            // A program written by a probe has no sequence, and no hash that would detect a changed bit in it.
            Some(running) if running.kind == Kind::Signed && self.sequence < running.sequence => {
                Err(Refusal::Older)
            }
            _ => Ok(()),
        }
    }
}

/// Value of a hexadecimal digit; 0 for any other character.
const fn hexadecimal(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        b'a'..=b'f' => digit - b'a' + 10,
        _ => 0,
    }
}

/// Number of the program in a slot for object 0x1F56, as [`Header::identification`]. The program must be whole, like
/// the running program.
pub fn identification(flash: &impl Flash, slot: Slot) -> u32 {
    let word = |at: u32| flash.read(slot.start() + at);
    match (word(8).to_le_bytes(), word(20).to_le_bytes()) {
        ([_, 1, ..], _) => word(44),
        ([_, 0, ..], [.., 0]) => word(24).swap_bytes(),
        _ => 0,
    }
}

/// Takes the first bytes of a header. Missing bytes are zeros; a header's size excludes that.
fn take<const N: usize>(bytes: &mut &[u8]) -> [u8; N] {
    match bytes.split_first_chunk() {
        Some((first, rest)) => {
            *bytes = rest;
            *first
        }
        None => [0; N],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header {
            kind: Kind::Signed,
            board: Board::Feather,
            length: 96_000,
            sequence: 1_800_000_000,
            version: [0, 2, 1],
            sources: Sources::Changed,
            commit: core::array::from_fn(|i| i as u8),
            hash: [7; 32],
            signature: core::array::from_fn(|i| 200 - i as u8),
        }
    }

    #[test]
    fn header_survives_its_bytes() {
        let header = header();
        let bytes = header.encode();
        assert_eq!(Header::decode(&bytes), Ok(header));
        assert_eq!(&bytes[..12], b"FOOTFALL\x01\x01\x02\x00");
        assert_eq!(bytes[SIGNED], 200);
        assert!(bytes[140..].iter().all(|byte| *byte == 0xFF));
        assert_eq!(header.identification(), 0x0707_0707);
    }

    #[test]
    fn header_of_a_probe_decodes() {
        for (commit, number) in
            [("37048bdeaf0f5f4d2a9c1b7e3d5566778899aabb", 0x3704_8BDE), ("", 0), ("37048bde", 0)]
        {
            for board in Board::ALL {
                let mut bytes = [0xFF; HEADER];
                bytes[..USED].copy_from_slice(&Header::probed(board, commit));
                let header = Header::decode(&bytes).expect("a header");
                assert_eq!((header.kind, header.board), (Kind::Probed, board));
                assert_eq!((header.sequence, header.identification()), (0, number));
            }
        }
    }

    #[test]
    fn damaged_header_is_refused_with_the_reason() {
        let refused = |at: usize, byte: u8| {
            let mut bytes = header().encode();
            bytes[at] = byte;
            Header::decode(&bytes)
        };
        assert_eq!(refused(0, b'f'), Err(Refusal::NotAnImage));
        assert_eq!(refused(8, 2), Err(Refusal::UnknownFormat));
        assert_eq!(refused(9, 2), Err(Refusal::UnknownFormat));
        assert_eq!(refused(10, 9), Err(Refusal::OtherBoard));
        assert_eq!(refused(12, 1), Err(Refusal::WrongLength));
        assert_eq!(refused(15, 1), Err(Refusal::WrongLength));
        assert_eq!(refused(USED, 0), Err(Refusal::NotAnImage));
        assert_eq!(refused(HEADER - 1, 0), Err(Refusal::NotAnImage));
        assert_eq!(Header::decode(&[0xFF; HEADER]), Err(Refusal::NotAnImage));
    }

    #[test]
    fn program_of_another_board_or_age_is_refused() {
        let new = header();
        let running = Header { sequence: new.sequence + 1, ..new };
        assert_eq!(new.check(Board::Feather, None), Ok(()));
        assert_eq!(new.check(Board::Feather, Some(&new)), Ok(()));
        let probed = Header { kind: Kind::Probed, ..running };
        assert_eq!(new.check(Board::Feather, Some(&probed)), Ok(()));
        assert_eq!(new.check(Board::Reference, None), Err(Refusal::OtherBoard));
        assert_eq!(new.check(Board::Feather, Some(&running)), Err(Refusal::Older));
        assert_eq!(probed.check(Board::Feather, None), Err(Refusal::Unsigned));
    }

    #[test]
    fn refusals_are_found_by_number_and_status() {
        for refusal in Refusal::ALL {
            assert_eq!(Refusal::from_number(refusal.number()), Some(refusal));
            let status = refusal.flash_status();
            assert_eq!(Refusal::from_flash_status(status), Some(refusal));
            assert_eq!(status & 1, 0);
        }
        assert_eq!(Refusal::from_flash_status(0), None);
    }
}
