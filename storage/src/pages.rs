//! A log of items in two pages of flash. The newest complete item is valid.
//!
//! One page is being written. The other is blank or holds earlier items. When an item no longer fits, the other page is
//! erased, the full page is closed, and writing continues in the other. The newest item is never in the page that is
//! erased, so a power cut leaves that item or the one after it.
//!
//! | bytes of a page | field |
//! |---|---|
//! | 0 to 3 | 0 if the page is in use: the start of its first item |
//! | 4 … | the first item without its start, then the other items |
//! | the last 4 | 0 if the page is closed |
//!
//! | bytes of an item | field |
//! |---|---|
//! | 0 to 3 | start: 0 |
//! | 4 to 7 | CRC-32 (ISO-HDLC) of the data |
//! | 8, 9 | length of the data, not 0 |
//! | 10, 11 | complement of the length |
//! | 12 … | the data, then 1 to 4 bytes of 0 up to a whole word |
//!
//! The last byte of an item is written last. An item with its last byte was complete, and has decayed if its CRC is
//! wrong. A mark counts as 0 from four cleared bits on. Searching for an item writes and erases nothing.
//!
//! **Weak bits.** A power cut can leave bits that read differently from one time to the next, in the word that was
//! being written, or all over a page that was being erased. An acknowledged item never depends on such a bit:
//!
//! - Before an item is written, the mark of its page is written again, and the remains of interrupted items before it
//!   are set to zero. So the page is firmly in use, and what is found in it does not change.
//! - An item begins two words behind the last start, even if the word between them reads as blank. So it never shares a
//!   word with the remains of another.
//! - Before a page is erased, the newest item of the other page is written again, because it may read as complete
//!   although its last word was interrupted.
//! - Then the items of the page are made invalid, so a half-erased page holds none that could count as the newest.
//! - A page is erased even if it reads as blank, because an interrupted erase can read so. The full page is closed only
//!   after the erase.

use core::cmp::Reverse;
use core::ops::Range;

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};
use embedded_storage::nor_flash::NorFlash;

use crate::{Erase, StoreFailed};

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Size of a word, the smallest unit of a write, bytes.
const WORD: u32 = 4;

/// Size of the header between an item's start and its data, bytes.
const HEADER: u32 = 8;

/// Number of wrong bits with which a mark or a length is still recognised.
const DECAYED: u32 = 4;

/// Bytes read at once.
const CHUNK: usize = 64;

/// Attempts to write an item before the flash counts as worn out.
const ATTEMPTS: usize = 2;

/// State of a page, the least current first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PageState {
    /// The page has no mark: it is blank, or half erased.
    Unmarked,
    /// The page is full.
    Closed,
    /// The page takes more items.
    Open,
}

/// Complete item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// Start of its data, in bytes of the flash.
    pub(super) data: u32,
    /// Length of the data, bytes.
    pub(super) length: u16,
    check: u32,
}

impl Item {
    /// End of the zeros after its data, in bytes of the flash.
    fn end(&self) -> u32 {
        self.data + padded(self.length)
    }
}

/// Content of a page.
#[derive(Clone, Copy, Debug)]
struct Page {
    state: PageState,
    newest: Option<Item>,
    /// Whether an item after the newest was completely written but does not match its checksum.
    has_decayed: bool,
    /// Start of the blank part.
    free: u32,
}

/// Result of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Latest {
    /// Newest complete item.
    pub(super) item: Option<Item>,
    /// Whether a newer item has decayed.
    pub(super) has_decayed: bool,
}

pub(super) struct Pages<F> {
    flash: F,
    start: u32,
}

impl<F: NorFlash> Pages<F>
where
    StoreFailed: From<F::Error>,
{
    const SIZE: u32 = F::ERASE_SIZE as u32;

    /// Bytes of data checked in a page. Items of a store do not overlap, except for their remains after a power cut. If
    /// a page has more, no item behind them is found, and none is written to it: checking the page in full could take
    /// longer than the watchdog's timeout.
    const MOST_CHECKED: u32 = 2 * Self::SIZE;

    /// Opens the pages in `range`; `None` if `range` is not two whole pages.
    pub(super) fn new(flash: F, range: &Range<u32>) -> Option<Self> {
        const { assert!((WORD as usize).is_multiple_of(F::WRITE_SIZE) && F::READ_SIZE == 1) };
        let whole = [range.start, range.end].map(|end| end.is_multiple_of(Self::SIZE)) == [true; 2];
        let pages = range.end.checked_sub(range.start)? / Self::SIZE;
        (whole && pages >= 2).then_some(Self { flash, start: range.start })
    }

    pub(super) const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    pub(super) fn release(self) -> F {
        self.flash
    }

    pub(super) const fn start(&self) -> u32 {
        self.start
    }

    const fn base(&self, page: usize) -> u32 {
        self.start + page as u32 * Self::SIZE
    }

    pub(super) fn read<const N: usize>(&mut self, at: u32) -> Result<[u8; N], F::Error> {
        let mut bytes = [0; N];
        self.flash.read(at, &mut bytes)?;
        Ok(bytes)
    }

    /// Returns whether this log has written to a page, judged from the start of each: the mark, then the header of an
    /// item or nothing yet, each with up to [`DECAYED`] wrong bits. Data of other programs have neither.
    pub(super) fn were_used(&mut self) -> Result<bool, F::Error> {
        Ok(self.was_used(0)? || self.was_used(1)?)
    }

    fn was_used(&mut self, page: usize) -> Result<bool, F::Error> {
        let [m0, m1, m2, m3, header @ ..] =
            self.read::<{ (WORD + HEADER) as usize }>(self.base(page))?;
        let [.., l0, l1, k0, k1] = header;
        let wrong = u16::from_le_bytes([l0, l1]) ^ !u16::from_le_bytes([k0, k1]);
        let is_marked = u32::from_le_bytes([m0, m1, m2, m3]).count_ones() <= DECAYED;
        let has_item = wrong.count_ones() <= DECAYED || header == [0xFF; HEADER as usize];
        Ok(is_marked && has_item)
    }

    fn is_blank(&mut self, from: u32, to: u32) -> Result<bool, F::Error> {
        self.all(from..to, |byte| byte == 0xFF)
    }

    /// Returns whether all bytes satisfy `is`. Stops at the first byte that does not.
    fn all(&mut self, range: Range<u32>, mut is: impl FnMut(u8) -> bool) -> Result<bool, F::Error> {
        let end = range.end;
        for at in range.step_by(CHUNK) {
            let mut chunk = [0; CHUNK];
            let length = CHUNK.min((end - at) as usize);
            let part = chunk.get_mut(..length).unwrap_or_default();
            self.flash.read(at, part)?;
            if !part.iter().all(|byte| is(*byte)) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Finds the newest complete item.
    pub(super) fn newest(&mut self) -> Result<Latest, F::Error> {
        let pages = self.look()?;
        let Some(best) = best(&pages) else {
            return Ok(Latest {
                item: None,
                has_decayed: pages.iter().any(|page| page.has_decayed),
            });
        };
        // Damage in an earlier page, or in one that was being erased, is not reported.
        let is_later = |page: &Page| page.state > best.state;
        let is_best = |page: &Page| page.newest == best.newest;
        let mut pages = pages.iter().filter(|page| is_best(page) || is_later(page));
        Ok(Latest { item: best.newest, has_decayed: pages.any(|page| page.has_decayed) })
    }

    fn look(&mut self) -> Result<[Page; 2], F::Error> {
        Ok([self.scan(0)?, self.scan(1)?])
    }

    fn scan(&mut self, page: usize) -> Result<Page, F::Error> {
        let (base, end) = (self.base(page), self.base(page + 1) - WORD);
        let [first] = self.read(base)?;
        let [last] = self.read(end + WORD - 1)?;
        // The search begins at the mark, which is the start of the first item.
        let mut at = base;
        let mut found = Page {
            state: match (is_marked(first), is_marked(last)) {
                (true, false) => PageState::Open,
                (true, true) => PageState::Closed,
                (false, _) => PageState::Unmarked,
            },
            newest: None,
            has_decayed: false,
            free: base,
        };
        let mut checked = 0;
        while at + HEADER <= end {
            let header = self.read(at)?;
            if header == [0xFF; HEADER as usize] {
                let next = end.min(at + CHUNK as u32);
                at = if self.is_blank(at, next)? { next } else { at + WORD };
                continue;
            }
            let Some(item) = item(at, header, end) else {
                // Not an item, or only the beginning of one.
                found.free = found.free.max(at + HEADER);
                at += WORD;
                continue;
            };
            let next = item.end();
            found.free = found.free.max(next);
            checked += u32::from(item.length);
            if checked > Self::MOST_CHECKED {
                found.state = PageState::Unmarked;
                found.has_decayed = true;
                break;
            }
            if self.check(&item)? == item.check {
                found.newest = Some(item);
                found.has_decayed = false;
                at = next;
            } else {
                found.has_decayed |= self.read(next - 1)? == [0];
                at += WORD;
            }
        }
        Ok(found)
    }

    /// Reads an item from its start.
    pub(super) const fn record(&mut self, item: Item) -> Record<'_, F> {
        Record { at: item.data, digest: CRC.digest(), item, flash: &mut self.flash }
    }

    /// CRC of an item's data.
    fn check(&mut self, item: &Item) -> Result<u32, F::Error> {
        let mut digest = CRC.digest();
        self.all(item.data..item.data + u32::from(item.length), |byte| {
            digest.update(&[byte]);
            true
        })?;
        Ok(digest.finalize())
    }

    /// Writes an item and reads it back. It is then the newest item.
    ///
    /// # Errors
    /// See [`StoreFailed`]. The newest item is still the previous one.
    pub(super) fn append(&mut self, data: &[u8], erase: Erase) -> Result<(), StoreFailed> {
        let length = u16::try_from(data.len()).map_err(|_| StoreFailed::Flash)?;
        let check = CRC.checksum(data);
        for _ in 0..ATTEMPTS {
            let at = self.make_room(WORD + HEADER + padded(length), erase)?;
            let written = Item { data: at + WORD + HEADER, length, check };
            self.write(at, &written, data)?;
            if self.newest()?.item == Some(written) {
                return Ok(());
            }
        }
        Err(StoreFailed::Flash)
    }

    /// Writes an item behind its start at `at`.
    fn write(&mut self, at: u32, item: &Item, data: &[u8]) -> Result<(), F::Error> {
        self.mark(at)?;
        let [c0, c1, c2, c3] = item.check.to_le_bytes();
        let [l0, l1] = item.length.to_le_bytes();
        self.flash.write(at + WORD, &[c0, c1, c2, c3, l0, l1, !l0, !l1])?;
        let (words, rest) = data.as_chunks::<{ WORD as usize }>();
        self.flash.write(item.data, words.as_flattened())?;
        let end = item.data + words.as_flattened().len() as u32;
        // The zeros come after all data, so that an interrupted item never counts as complete and decayed.
        for filler in [0xFF, 0] {
            let mut last = [filler; WORD as usize];
            last.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            self.flash.write(end, &last)?;
        }
        Ok(())
    }

    /// Returns the start of room for an item of `room` bytes, in a page that is ready for it.
    fn make_room(&mut self, room: u32, erase: Erase) -> Result<u32, StoreFailed> {
        if room + WORD > Self::SIZE {
            return Err(StoreFailed::Flash);
        }
        let pages = self.look()?;
        let open = |(_, page): &(usize, &Page)| page.state == PageState::Open;
        let open = pages.iter().enumerate().filter(open);
        let open = open.max_by_key(|(i, page)| (page.newest.is_some(), Reverse(*i)));
        if let Some((i, page)) = open
            && page.free + room <= self.base(i + 1) - WORD
        {
            let free = page.free;
            let remains = page.newest.map_or(self.base(i), |item| item.end())..free;
            self.mark(self.base(i))?;
            for at in remains.step_by(WORD as usize) {
                self.mark(at)?;
            }
            return Ok(free);
        }
        let full = best(&pages).and_then(|best| best.newest);
        let (next, is_ready) = match full {
            Some(item) => (usize::from(item.data < self.base(1)), false),
            None => {
                let next = usize::from(!self.is_blank(self.base(0), self.base(1))?);
                (next, self.is_blank(self.base(next), self.base(next + 1))?)
            }
        };
        let base = self.base(next);
        if !is_ready {
            if erase == Erase::Refused {
                return Err(StoreFailed::NeedsErase);
            }
            if let Some(item) = full {
                self.write_again(&item)?;
            }
            self.erase(next)?;
        }
        let other = self.base(1 - next);
        if full.is_some() || !self.is_blank(other, other + Self::SIZE)? {
            self.mark(other)?;
            self.mark(other + Self::SIZE - WORD)?;
        }
        // The item's start is the page's mark.
        Ok(base)
    }

    /// Writes an item again as it reads, and checks the copy.
    ///
    /// # Errors
    /// The flash failed, or the item no longer reads as complete.
    fn write_again(&mut self, item: &Item) -> Result<(), StoreFailed> {
        for _ in 0..ATTEMPTS {
            let mut digest = CRC.digest();
            let data = item.data..item.data + u32::from(item.length);
            for at in data.clone().step_by(CHUNK) {
                let mut chunk = [0; CHUNK];
                let length = CHUNK.min((data.end - at) as usize);
                // The last word is whole, because zeros follow the data.
                let words = chunk.get_mut(..length.next_multiple_of(WORD as usize));
                let words = words.unwrap_or_default();
                self.flash.read(at, words)?;
                self.flash.write(at, words)?;
                digest.update(chunk.get(..length).unwrap_or_default());
            }
            if digest.finalize() == item.check {
                return Ok(());
            }
        }
        Err(StoreFailed::Flash)
    }

    /// Makes the items of a page invalid, and erases it.
    fn erase(&mut self, page: usize) -> Result<(), F::Error> {
        let (base, end) = (self.base(page), self.base(page + 1));
        for at in (base + WORD..end - WORD - HEADER).step_by(WORD as usize) {
            let header = self.read(at)?;
            if item(at, header, end - WORD).is_some() {
                self.flash.write(at, &[0; HEADER as usize])?;
            }
        }
        self.flash.erase(base, end)
    }

    fn mark(&mut self, at: u32) -> Result<(), F::Error> {
        self.flash.write(at, &[0; WORD as usize])
    }
}

/// Item that is being read.
pub(super) struct Record<'a, F> {
    flash: &'a mut F,
    item: Item,
    at: u32,
    digest: Digest<'static, u32, NoTable>,
}

impl<F: NorFlash> Record<'_, F> {
    /// Reads the next bytes; `None` if fewer are left, or the flash failed.
    pub(super) fn read<const N: usize>(&mut self) -> Option<[u8; N]> {
        let next = self.at + N as u32;
        let mut bytes = [0; N];
        if next > self.item.data + u32::from(self.item.length)
            || self.flash.read(self.at, &mut bytes).is_err()
        {
            return None;
        }
        self.digest.update(&bytes);
        self.at = next;
        Some(bytes)
    }

    /// Reads the rest. Returns whether all bytes that were read match the checksum of the item.
    pub(super) fn has_checksum_after_rest(mut self) -> bool {
        while self.read::<1>().is_some() {}
        self.digest.finalize() == self.item.check
    }
}

/// Item whose header is at `at`, if its length is valid and it ends before `end`.
fn item(at: u32, header: [u8; HEADER as usize], end: u32) -> Option<Item> {
    let [c0, c1, c2, c3, l0, l1, k0, k1] = header;
    let length = u16::from_le_bytes([l0, l1]);
    let check = u32::from_le_bytes([c0, c1, c2, c3]);
    let item = Item { data: at + HEADER, length, check };
    let is_item = length != 0 && u16::from_le_bytes([k0, k1]) == !length && item.end() <= end;
    is_item.then_some(item)
}

/// Page with the newest item.
fn best(pages: &[Page; 2]) -> Option<&Page> {
    let [first, second] = pages;
    match (first.newest, second.newest) {
        (None, None) => None,
        (Some(_), None) => Some(first),
        (None, Some(_)) => Some(second),
        (Some(_), Some(_)) if second.state > first.state => Some(second),
        (Some(_), Some(_)) => Some(first),
    }
}

const fn is_marked(byte: u8) -> bool {
    byte.count_zeros() >= 4
}

/// Size of an item's data with the zeros after them, bytes.
fn padded(length: u16) -> u32 {
    (u32::from(length) + 1).next_multiple_of(WORD)
}

#[cfg(test)]
pub(super) mod tests {
    use core::convert::Infallible;

    use super::*;
    use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
    use std::{vec, vec::Vec};

    const PAGE: usize = 64;

    /// Two pages, with the numbers of bytes written and read so far.
    pub(crate) struct Flash<const SIZE: usize> {
        pub(crate) bytes: Vec<u8>,
        written: usize,
        read: usize,
    }

    impl<const SIZE: usize> ErrorType for Flash<SIZE> {
        type Error = Infallible;
    }

    impl<const SIZE: usize> ReadNorFlash for Flash<SIZE> {
        const READ_SIZE: usize = 1;

        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
            bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
            self.read += bytes.len();
            Ok(())
        }

        fn capacity(&self) -> usize {
            self.bytes.len()
        }
    }

    impl<const SIZE: usize> NorFlash for Flash<SIZE> {
        const WRITE_SIZE: usize = WORD as usize;
        const ERASE_SIZE: usize = SIZE;

        fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
            self.bytes[from as usize..to as usize].fill(0xFF);
            Ok(())
        }

        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
            let to = self.bytes[offset as usize..].iter_mut();
            to.zip(bytes).for_each(|(byte, new)| *byte &= new);
            self.written += bytes.len();
            Ok(())
        }
    }

    pub(crate) fn holding<const SIZE: usize>(bytes: Vec<u8>) -> Pages<Flash<SIZE>> {
        let range = 0..bytes.len() as u32;
        let flash = Flash { bytes, written: 0, read: 0 };
        Pages::new(flash, &range).expect("two pages")
    }

    fn pages() -> Pages<Flash<PAGE>> {
        holding(vec![0xFF; 2 * PAGE])
    }

    /// Data that begin with 0 and differ by `number`.
    fn data<const N: usize>(number: u8) -> [u8; N] {
        let mut data = [number; N];
        data[0] = 0;
        data
    }

    #[test]
    fn a_page_holds_the_largest_item_and_rejects_a_byte_more() {
        let mut fits = pages();
        assert_eq!(fits.append(&data::<47>(7), Erase::Allowed), Ok(()));
        for mut full in [pages(), fits] {
            let before = (full.flash().bytes.clone(), full.flash().written);
            let refused = full.append(&data::<48>(8), Erase::Allowed);
            assert_eq!(refused, Err(StoreFailed::Flash));
            assert_eq!((full.flash().bytes.clone(), full.flash().written), before);
        }
    }

    #[test]
    fn items_of_every_length_are_found_on_every_page() {
        let mut pages = pages();
        for number in 1..100 {
            let data = data::<47>(number);
            let data = &data[..1 + usize::from(number) * 5 % 47];
            assert_eq!(pages.append(data, Erase::Allowed), Ok(()));
            let Ok(Latest { item: Some(item), has_decayed: false }) = pages.newest() else {
                panic!("{number}");
            };
            assert_eq!(usize::from(item.length), data.len());
            let at = item.data as usize;
            assert_eq!(&pages.flash().bytes[at..at + data.len()], data, "{number}");
        }
    }

    #[test]
    fn a_store_succeeds_even_if_both_pages_look_used() {
        let written = |number: u8| {
            let mut pages = pages();
            assert_eq!(pages.append(&data::<5>(number), Erase::Allowed), Ok(()));
            pages.release().bytes
        };
        let mut both = written(1);
        both[PAGE..].copy_from_slice(&written(2)[..PAGE]);
        let mut pages = holding::<PAGE>(both);
        assert_eq!(pages.append(&data::<5>(3), Erase::Refused), Ok(()));
    }

    /// Headers of items of this length without matching data, one after the other.
    fn crafted(length: u16, filler: u8, every: usize) -> Vec<u8> {
        let mut bytes = vec![filler; 2 * BOARD_PAGE];
        let [l0, l1] = length.to_le_bytes();
        for page in bytes.chunks_mut(BOARD_PAGE) {
            let (mark, items) = page.split_at_mut(WORD as usize);
            mark.fill(0);
            for item in items.chunks_exact_mut(every) {
                item[..HEADER as usize].copy_from_slice(&[filler, 1, 2, 3, l0, l1, !l0, !l1]);
            }
        }
        bytes
    }

    /// Size of a page on the board, bytes.
    pub(crate) const BOARD_PAGE: usize = 16 * 1024;

    #[test]
    fn searching_crafted_pages_reads_a_bounded_number_of_bytes() {
        let mut most = 0;
        for length in [1, 8, 64, 512, 600, 2048, 8192, 12_000, 16_000] {
            for filler in [0, 0x5A, 0xFF] {
                for every in [8, 12, 64, 256] {
                    let case = (length, filler, every);
                    let mut pages = holding::<BOARD_PAGE>(crafted(length, filler, every));
                    assert!(pages.newest().expect("a search").item.is_none(), "{case:?}");
                    most = most.max(pages.flash().read);
                    let stored = data::<200>(7);
                    assert_eq!(pages.append(&stored, Erase::Allowed), Ok(()), "{case:?}");
                    let newest = pages.newest().expect("a search");
                    assert_eq!(newest.item.map(|item| item.length), Some(200), "{case:?}");
                    assert!(!newest.has_decayed, "{case:?}");
                }
            }
        }
        // In two pages each byte is read twice as an item, each word as a header, and the rest of a chunk if it is blank.
        let bound = 2 * BOARD_PAGE * (2 + HEADER as usize / 4 + CHUNK / 4);
        assert!(most <= bound, "{most} of {bound} bytes");
    }
}
