//! Programs of the boards as they are written to flash: [`segments`] of an ELF, and the signed [`image`] that an update sends.

use bootloader::flash::Slot;
use bootloader::image::{
    HASHED, HEADER, Header, Kind, LONGEST, Refusal, SHORTEST, SIGNED, Sources,
};
use bootloader::verify::Hash;
use object::Endianness;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

/// Private half of the development key, which everybody has: for tests, and for boards on a desk.
pub static DEVELOPMENT_KEY: &[u8; 32] = include_bytes!("../../../bootloader/keys/development.key");

/// Reason why no image can be made from an ELF.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// The file is not an ELF for a 32-bit Arm.
    #[error("not an ELF for Arm: {0}")]
    NotAnElf(String),
    /// The program has no header that names its board.
    #[error("no header at {at:#010x}: {}", .why.words(), at = Slot::Running.start())]
    NoHeader {
        /// Reason.
        why: Refusal,
    },
    /// A part of the program is not where the bootloader puts it.
    #[error("a segment of {length} bytes at {address:#010x} is outside of the program's slot")]
    Outside {
        /// Address of the segment.
        address: u32,
        /// Length of the segment, bytes.
        length: usize,
    },
    /// The program is empty or too long.
    #[error("the program has {length} bytes: {SHORTEST} to {LONGEST} fit")]
    Length {
        /// Length of the program, bytes.
        length: usize,
    },
}

/// Origin of a program, for its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramOrigin {
    /// Version: major, minor, patch.
    pub version: [u8; 3],
    /// Commit.
    pub commit: [u8; 20],
    /// Whether the sources were the same as in the commit.
    pub sources: Sources,
    /// Time of the commit, s since 1970. An update does not lower it.
    pub sequence: u32,
}

/// Makes the image of an ELF, signed with the private key `key`.
///
/// # Errors
/// The ELF is not a program that a bootloader starts.
pub fn image(elf: &[u8], origin: &ProgramOrigin, key: &[u8; 32]) -> Result<Vec<u8>, ImageError> {
    let mut slot = contents(elf)?;
    let bytes = slot.first_chunk::<HEADER>();
    let bytes = bytes.ok_or(ImageError::Length { length: slot.len() })?;
    let found = Header::decode(bytes).map_err(|why| ImageError::NoHeader { why })?;
    let program = slot.split_off(HEADER);
    let length = program.len() as u32;
    if !(SHORTEST..=LONGEST).contains(&length) {
        return Err(ImageError::Length { length: program.len() });
    }
    let mut header = Header {
        kind: Kind::Signed,
        board: found.board,
        length,
        sequence: origin.sequence,
        version: origin.version,
        sources: origin.sources,
        commit: origin.commit,
        hash: [0; 32],
        signature: [0; 64],
    };
    let mut hash = Hash::new();
    hash.update(&program);
    hash.update(header.encode().get(..HASHED).unwrap_or(&[]));
    header.hash = hash.finish();
    let pair = salty::Keypair::from(key);
    let bytes = header.encode();
    header.signature = pair.sign(bytes.get(..SIGNED).unwrap_or(&[])).to_bytes();
    let mut image = header.encode().to_vec();
    image.extend(program);
    Ok(image)
}

/// Public half of a private key, for the bootloader.
#[must_use]
pub fn public_key(key: &[u8; 32]) -> [u8; 32] {
    salty::Keypair::from(key).public.to_bytes()
}

/// Bytes of the slot that the ELF fills, from the header to the last one, in whole words.
fn contents(elf: &[u8]) -> Result<Vec<u8>, ImageError> {
    let start = Slot::Running.start();
    let mut slot = Vec::new();
    for (address, bytes) in segments(elf)? {
        let outside = ImageError::Outside { address, length: bytes.len() };
        let at = address.checked_sub(start).ok_or(outside.clone())? as usize;
        let end = at + bytes.len();
        if end > HEADER + LONGEST as usize {
            return Err(outside);
        }
        if slot.len() < end {
            slot.resize(end.next_multiple_of(4), 0xFF);
        }
        slot[at..end].copy_from_slice(bytes);
    }
    Ok(slot)
}

/// Returns load addresses and contents of the segments that a programmer writes to the flash.
///
/// # Errors
/// [`ImageError::NotAnElf`].
pub fn segments(elf: &[u8]) -> Result<Vec<(u32, &[u8])>, ImageError> {
    let refused = |error: object::Error| ImageError::NotAnElf(error.to_string());
    let header = FileHeader32::<Endianness>::parse(elf).map_err(refused)?;
    let endian = header.endian().map_err(refused)?;
    if header.e_machine(endian) != EM_ARM {
        return Err(ImageError::NotAnElf("another machine".into()));
    }
    let mut segments = Vec::new();
    for segment in header.program_headers(endian, elf).map_err(refused)? {
        let bytes = segment
            .data(endian, elf)
            .map_err(|()| ImageError::NotAnElf("a segment lies outside the file".into()))?;
        if segment.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            segments.push((segment.p_paddr(endian), bytes));
        }
    }
    Ok(segments)
}
