//! Programs in their slots: whether a program is whole, whether two are equal, and copies.

use crate::flash::{Flash, FlashFailed, Sector, Slot};
use crate::image::{HASHED, HEADER, Header, Kind, LONGEST, MARK, Refusal};
use crate::verify::Hash;

/// Reads the header of a slot.
///
/// # Errors
/// The slot has no header.
pub fn header(flash: &impl Flash, slot: Slot) -> Result<Header, Refusal> {
    Header::decode(&header_bytes(flash, slot))
}

/// Reads the bytes of a slot's header, valid or not, without the mark of a confirmed program.
pub fn header_bytes(flash: &impl Flash, slot: Slot) -> [u8; HEADER] {
    let mut bytes = [0xFF; HEADER];
    if let Some(bytes) = bytes.get_mut(..MARK) {
        read(flash, slot.start(), bytes);
    }
    bytes
}

/// Reads bytes from an address that is a multiple of 4.
fn read(flash: &impl Flash, start: u32, bytes: &mut [u8]) {
    for (at, piece) in (start..).step_by(4).zip(bytes.chunks_mut(4)) {
        for (to, from) in piece.iter_mut().zip(flash.read(at).to_le_bytes()) {
            *to = from;
        }
    }
}

/// Returns the header of the program in a slot if both match the hash in the header.
///
/// A program written by a probe has neither hash nor signature. It counts as whole, because a copy of it gets its header
/// last. If a program of this kind has a hash or a signature, it was sent, and a bit of its kind has been cleared.
///
/// # Errors
/// The reason why the program is not whole.
pub fn check(flash: &impl Flash, slot: Slot) -> Result<Header, Refusal> {
    let header = header(flash, slot)?;
    if header.kind == Kind::Probed {
        let is_blank = header.hash == [0xFF; 32] && header.signature == [0xFF; 64];
        return if is_blank { Ok(header) } else { Err(Refusal::WrongHash) };
    }
    let mut hash = Hash::new();
    let mut bytes = [0; 64];
    // The header comes last, so that the program is hashed by whole blocks.
    for (start, length) in [(HEADER as u32, header.length), (0, HASHED as u32)] {
        let (mut at, mut rest) = (slot.start() + start, length);
        while rest > 0 {
            let length = rest.min(bytes.len() as u32);
            let piece = bytes.get_mut(..length as usize).unwrap_or_default();
            read(flash, at, piece);
            hash.update(piece);
            at += length;
            rest -= length;
        }
    }
    if hash.finish() == header.hash { Ok(header) } else { Err(Refusal::WrongHash) }
}

/// Addresses of the words of a program with its header, except the mark.
fn words(header: &Header) -> impl DoubleEndedIterator<Item = u32> {
    let length = match header.kind {
        Kind::Signed => header.length,
        // The length is unknown.
        Kind::Probed => LONGEST,
    };
    (0..HEADER as u32 + length).step_by(4).filter(|at| *at != MARK as u32)
}

/// Returns whether two slots hold the same program.
pub fn same(flash: &impl Flash, one: Slot, other: Slot) -> bool {
    let Ok(header) = header(flash, one) else {
        return false;
    };
    words(&header).all(|at| flash.read(one.start() + at) == flash.read(other.start() + at))
}

/// Erases a slot. The header goes first, so that an interrupted erase leaves no program.
///
/// # Errors
/// The flash failed.
pub fn clear(flash: &mut impl Flash, slot: Slot) -> Result<(), FlashFailed> {
    if flash.read(slot.start()) != u32::MAX {
        flash.program(slot.start(), 0)?;
    }
    flash.erase(Sector::Slot(slot))
}

/// Clears a slot, and copies a program to it. The first word comes last, so that an interrupted copy has no header.
///
/// # Errors
/// The flash failed, or the program has no header.
pub fn copy(flash: &mut impl Flash, from: Slot, to: Slot) -> Result<(), FlashFailed> {
    let header = header(flash, from).map_err(|_| FlashFailed)?;
    clear(flash, to)?;
    for at in words(&header).rev() {
        let word = flash.read(from.start() + at);
        // Erased flash already reads so.
        if word != u32::MAX {
            flash.program(to.start() + at, word)?;
        }
    }
    Ok(())
}

/// Returns whether a slot is erased.
pub fn is_blank(flash: &impl Flash, slot: Slot) -> bool {
    (0..crate::flash::SLOT_SIZE / 4).all(|k| flash.read(slot.start() + 4 * k) == u32::MAX)
}
