//! A log of items in two pages of flash; the newest complete one is valid.
//!
//! One page is written, the other is blank or holds earlier items. When an item no longer
//! fits, the other page is erased unless blank, the full one is closed, and writing continues in the other: the
//! newest item is never in the page that is erased, so a power cut leaves it or the one after it.
//!
//! The format is that of the crate `sequential-storage` 8, which earlier programs used, so that both
//! can read each other's pages:
//!
//! | bytes of a page | field |
//! |---|---|
//! | 0 to 3 | 0 where the page is in use |
//! | 4 … | items, one after the other |
//! | the last 4 | 0 where the page is closed |
//!
//! | bytes of an item | field |
//! |---|---|
//! | 0 to 3 | CRC-32C of the data, from 0xEEEEEEEE, its lowest byte never 0 or 0xFF |
//! | 4, 5 | length of the data |
//! | 6, 7 | CRC-16 of the length |
//! | 8 … | the data, a key in its first byte, filled up with 0 to whole words |
//!
//! A mark counts as 0 from four cleared bits on. Searching for an item writes and erases nothing.

use core::cmp::Reverse;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

use super::{Erase, StoreFailed};

/// Key of the settings, the only content of the pages.
pub(super) const KEY: u8 = 0;

/// Size of a word, the smallest unit of a write, bytes.
const WORD: u32 = 4;

/// Size of the header before an item's data, bytes.
const HEADER: u32 = 8;

/// Bytes read at once.
const CHUNK: usize = 64;

/// Attempts to write an item before the flash counts as worn out.
const ATTEMPTS: usize = 2;

/// State of a page, the least current first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    /// It has no mark: blank, or half erased.
    Unmarked,
    /// It is full.
    Closed,
    /// It takes more items.
    Open,
}

/// Complete item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// Start of its data, in bytes of the flash.
    pub(super) data: u32,
    /// Length of the data, bytes, including the key.
    pub(super) length: u16,
    check: u32,
}

/// Content of a page.
#[derive(Clone, Copy, Debug)]
struct Page {
    is: Use,
    newest: Option<Item>,
    /// Whether an item after the newest was completely written and does not match its checksum.
    damaged: bool,
    /// Start of the blank part.
    free: u32,
}

/// Result of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Latest {
    /// Newest complete item.
    pub(super) item: Option<Item>,
    /// Whether a newer one has decayed.
    pub(super) damaged: bool,
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

    /// Bytes of data checked in a page: items of a store do not overlap, except for their remains after a
    /// power cut. In a page with more, no item is found behind them, and none is written to it: checking it in
    /// full could take longer than the watchdog's timeout.
    const MOST_CHECKED: u32 = 2 * Self::SIZE;

    /// Opens the pages in `range`; `None` if it is not two whole pages.
    pub(super) fn new(flash: F, range: &Range<u32>) -> Option<Self> {
        const { assert!((WORD as usize).is_multiple_of(F::WRITE_SIZE) && F::READ_SIZE == 1) };
        let whole = [range.start, range.end].map(|end| end.is_multiple_of(Self::SIZE)) == [true; 2];
        let pages = range.end.checked_sub(range.start)? / Self::SIZE;
        (whole && pages >= 2).then_some(Self {
            flash,
            start: range.start,
        })
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

    /// Returns whether the pages are as after an erase.
    pub(super) fn are_blank(&mut self) -> Result<bool, F::Error> {
        self.is_blank(self.base(0), self.base(2))
    }

    fn is_blank(&mut self, from: u32, to: u32) -> Result<bool, F::Error> {
        self.all(from..to, |byte| byte == 0xFF)
    }

    /// Returns whether all bytes satisfy `is`; stops at the first that does not.
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
                damaged: pages.iter().any(|page| page.damaged),
            });
        };
        // Damage in an earlier page is not reported.
        let damaged = pages.iter().any(|page| page.damaged && page.is >= best.is);
        Ok(Latest {
            item: best.newest,
            damaged,
        })
    }

    fn look(&mut self) -> Result<[Page; 2], F::Error> {
        Ok([self.scan(0)?, self.scan(1)?])
    }

    fn scan(&mut self, page: usize) -> Result<Page, F::Error> {
        let (base, end) = (self.base(page), self.base(page + 1) - WORD);
        let [first] = self.read(base)?;
        let [last] = self.read(end + WORD - 1)?;
        let mut at = base + WORD;
        let mut found = Page {
            is: match (is_marked(first), is_marked(last)) {
                (true, false) => Use::Open,
                (true, true) => Use::Closed,
                (false, _) => Use::Unmarked,
            },
            newest: None,
            damaged: false,
            free: at,
        };
        let mut checked = 0;
        while at + HEADER <= end {
            let header @ [c0, c1, c2, c3, l0, l1, k0, k1] = self.read(at)?;
            if header == [0xFF; HEADER as usize] {
                let next = end.min(at + CHUNK as u32);
                at = if self.is_blank(at, next)? {
                    next
                } else {
                    at + WORD
                };
                continue;
            }
            let length = u16::from_le_bytes([l0, l1]);
            let data = at + HEADER;
            let next = data + u32::from(length).next_multiple_of(WORD);
            if u16::from_le_bytes([k0, k1]) != crc16([l0, l1]) || next > end {
                // Not an item, or only the beginning of one.
                found.free = found.free.max(data);
                at += WORD;
                continue;
            }
            found.free = found.free.max(next);
            checked += u32::from(length);
            if checked > Self::MOST_CHECKED {
                found.is = Use::Unmarked;
                found.damaged = true;
                break;
            }
            let check = u32::from_le_bytes([c0, c1, c2, c3]);
            if self.check(data, length)? == check && self.read(data)? == [KEY] {
                found.newest = Some(Item {
                    data,
                    length,
                    check,
                });
                found.damaged = false;
                at = next;
            } else {
                // Its last byte is written last, and is 0 where the data end before it.
                let complete =
                    !u32::from(length).is_multiple_of(WORD) && self.read(next - 1)? == [0];
                found.damaged |= complete;
                at += WORD;
            }
        }
        Ok(found)
    }

    fn check(&mut self, data: u32, length: u16) -> Result<u32, F::Error> {
        let mut crc = Crc32::NEW;
        self.all(data..data + u32::from(length), |byte| {
            crc = crc.with(byte);
            true
        })?;
        Ok(crc.finish())
    }

    /// Writes an item, and reads it back: it is then the newest.
    ///
    /// # Errors
    /// See [`StoreFailed`]; the newest item is still the previous one.
    pub(super) fn append(&mut self, data: &[u8], erase: Erase) -> Result<(), StoreFailed> {
        let length = u16::try_from(data.len()).map_err(|_| StoreFailed::Flash)?;
        let check = data.iter().fold(Crc32::NEW, |crc, byte| crc.with(*byte));
        let check = check.finish();
        for _ in 0..ATTEMPTS {
            let at = self.make_room(u32::from(length), erase)?;
            let written = Item {
                data: at + HEADER,
                length,
                check,
            };
            self.write(at, &written, data)?;
            if self.newest()?.item == Some(written) {
                return Ok(());
            }
        }
        Err(StoreFailed::Flash)
    }

    fn write(&mut self, at: u32, item: &Item, data: &[u8]) -> Result<(), F::Error> {
        let [c0, c1, c2, c3] = item.check.to_le_bytes();
        let [l0, l1] = item.length.to_le_bytes();
        let [k0, k1] = crc16([l0, l1]).to_le_bytes();
        self.flash.write(at, &[c0, c1, c2, c3, l0, l1, k0, k1])?;
        let (words, rest) = data.as_chunks::<{ WORD as usize }>();
        self.flash.write(item.data, words.as_flattened())?;
        if rest.is_empty() {
            return Ok(());
        }
        let mut last = [0; WORD as usize];
        last.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        let end = item.data + words.as_flattened().len() as u32;
        self.flash.write(end, &last)
    }

    /// Address where an item with `length` bytes of data fits, in a page that is ready for it.
    fn make_room(&mut self, length: u32, erase: Erase) -> Result<u32, StoreFailed> {
        let room = HEADER + length.next_multiple_of(WORD);
        if WORD + room + WORD > Self::SIZE {
            return Err(StoreFailed::Flash);
        }
        let pages = self.look()?;
        let open = |(_, page): &(usize, &Page)| page.is == Use::Open;
        let open = pages.iter().enumerate().filter(open);
        let open = open.max_by_key(|(i, page)| (page.newest.is_some(), Reverse(*i)));
        if let Some((i, page)) = open
            && page.free + room <= self.base(i + 1) - WORD
        {
            return Ok(page.free);
        }
        let full = best(&pages).and_then(|best| best.newest);
        let next = match full {
            Some(item) => usize::from(item.data < self.base(1)),
            None => usize::from(!self.is_blank(self.base(0), self.base(1))?),
        };
        let (base, end) = (self.base(next), self.base(next + 1));
        if !self.is_blank(base, end)? {
            if erase == Erase::Refused {
                return Err(StoreFailed::NeedsErase);
            }
            self.flash.erase(base, end)?;
        }
        if full.is_some() {
            let other = self.base(1 - next);
            self.mark(other)?;
            self.mark(other + Self::SIZE - WORD)?;
        }
        self.mark(base)?;
        Ok(base + WORD)
    }

    fn mark(&mut self, at: u32) -> Result<(), F::Error> {
        self.flash.write(at, &[0; WORD as usize])
    }
}

/// Page with the newest item.
fn best(pages: &[Page; 2]) -> Option<&Page> {
    let [first, second] = pages;
    match (first.newest, second.newest) {
        (None, None) => None,
        (Some(_), None) => Some(first),
        (None, Some(_)) => Some(second),
        (Some(_), Some(_)) if second.is > first.is => Some(second),
        (Some(_), Some(_)) => Some(first),
    }
}

const fn is_marked(byte: u8) -> bool {
    byte.count_zeros() >= 4
}

/// Koopman's CRC-16F/4.2, never 0xFFFF.
fn crc16(bytes: [u8; 2]) -> u16 {
    let mut crc = 0xFFFF_u16;
    for byte in bytes {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            let low = crc & 1;
            crc >>= 1;
            if low == 1 {
                crc ^= 0x1A2E;
            }
        }
    }
    match !crc {
        0xFFFF => 0xFFFE,
        crc => crc,
    }
}

/// Castagnoli's CRC-32 of the bytes so far.
#[derive(Clone, Copy)]
struct Crc32(u32);

impl Crc32 {
    const NEW: Self = Self(0xEEEE_EEEE);

    fn with(self, byte: u8) -> Self {
        let mut crc = self.0 ^ u32::from(byte);
        for _ in 0..8 {
            let low = crc & 1;
            crc >>= 1;
            if low == 1 {
                crc ^= 0x82F6_3B78;
            }
        }
        Self(crc)
    }

    /// The lowest byte is neither 0 nor 0xFF: a partly written checksum is never valid.
    const fn finish(self) -> u32 {
        let crc = !self.0;
        match crc {
            0 => 1,
            _ if matches!(crc as u8, 0 | 0xFF) => crc ^ 1,
            _ => crc,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
    use std::{vec, vec::Vec};

    const PAGE: usize = 64;

    /// Two pages, with the numbers of bytes written and read so far.
    struct Flash<const SIZE: usize> {
        bytes: Vec<u8>,
        written: usize,
        read: usize,
    }

    impl From<Infallible> for StoreFailed {
        fn from(never: Infallible) -> Self {
            match never {}
        }
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

    fn holding<const SIZE: usize>(bytes: Vec<u8>) -> Pages<Flash<SIZE>> {
        let range = 0..bytes.len() as u32;
        let flash = Flash {
            bytes,
            written: 0,
            read: 0,
        };
        Pages::new(flash, &range).expect("two pages")
    }

    fn pages() -> Pages<Flash<PAGE>> {
        holding(vec![0xFF; 2 * PAGE])
    }

    /// Data that begin with the key and differ by `number`.
    fn data<const N: usize>(number: u8) -> [u8; N] {
        let mut data = [number; N];
        data[0] = KEY;
        data
    }

    #[test]
    fn a_partly_written_checksum_is_never_valid() {
        for (bits, sum) in [
            (0x0000_0000, 0x0000_0001),
            (0x1234_5600, 0x1234_5601),
            (0x1234_56FF, 0x1234_56FE),
            (0x1234_5678, 0x1234_5678),
        ] {
            assert_eq!(Crc32(!bits).finish(), sum);
        }
    }

    #[test]
    fn a_page_holds_the_largest_item_and_rejects_a_byte_more() {
        let mut fits = pages();
        assert_eq!(fits.append(&data::<48>(7), Erase::Allowed), Ok(()));
        for mut full in [pages(), fits] {
            let before = (full.flash().bytes.clone(), full.flash().written);
            let refused = full.append(&data::<49>(8), Erase::Allowed);
            assert_eq!(refused, Err(StoreFailed::Flash));
            assert_eq!((full.flash().bytes.clone(), full.flash().written), before);
        }
    }

    #[test]
    fn items_of_every_length_are_found_on_every_page() {
        let mut pages = pages();
        for number in 1..100 {
            let data = data::<48>(number);
            let data = &data[..1 + usize::from(number) * 5 % 48];
            assert_eq!(pages.append(data, Erase::Allowed), Ok(()));
            let Ok(Latest {
                item: Some(item),
                damaged: false,
            }) = pages.newest()
            else {
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
        let [k0, k1] = crc16([l0, l1]).to_le_bytes();
        for page in bytes.chunks_mut(BOARD_PAGE) {
            let (mark, items) = page.split_at_mut(WORD as usize);
            mark.fill(0);
            for item in items.chunks_exact_mut(every) {
                item[..HEADER as usize].copy_from_slice(&[filler, 1, 2, 3, l0, l1, k0, k1]);
            }
        }
        bytes
    }

    /// Size of a page on the board, bytes.
    const BOARD_PAGE: usize = 16 * 1024;

    #[test]
    fn searching_crafted_pages_reads_a_bounded_number_of_bytes() {
        let mut most = 0;
        for length in [1, 8, 64, 512, 600, 2048, 8192, 12_000, 16_000] {
            for filler in [KEY, 0x5A, 0xFF] {
                for every in [8, 12, 64, 256] {
                    let case = (length, filler, every);
                    let mut pages = holding::<BOARD_PAGE>(crafted(length, filler, every));
                    assert!(pages.newest().expect("a search").item.is_none(), "{case:?}");
                    most = most.max(pages.flash().read);
                    let stored = data::<200>(7);
                    assert_eq!(pages.append(&stored, Erase::Allowed), Ok(()), "{case:?}");
                    let newest = pages.newest().expect("a search");
                    assert_eq!(newest.item.map(|item| item.length), Some(200), "{case:?}");
                    assert!(!newest.damaged, "{case:?}");
                }
            }
        }
        // Two pages: each byte twice as an item, each word's header, and the rest of a chunk where it is blank.
        let bound = 2 * BOARD_PAGE * (2 + HEADER as usize / 4 + CHUNK / 4);
        assert!(most <= bound, "{most} of {bound} bytes");
    }
}
