//! Settings in flash: two pages of records. The newest complete record is valid.
//!
//! A store appends a record with a checksum to a page and reads it back. Only then is the record reported as stored. If
//! it does not read back, it is written once more, behind the first. Whichever byte a power cut interrupts, the next
//! load returns the settings from before or from after the write, never a mixture. If the newest record has decayed,
//! the previous one is used, and that is reported. A load writes nothing. `pages` describes the pages themselves.
//!
//! **Cost of a store.** If code runs from the flash that is written, as on the board, each of some 160 words stalls the
//! processor for 16 µs, at most 100 µs. No tick is lost. About one store in 25 finds its page full and must erase the
//! other page, which stops everything for 0.25 to 0.5 s.
//!
//! An erase happens only where it is [allowed](Erase). The foot allows it in pre-operational and in stopped state,
//! where it sends no process data. In operational state it refuses a store that needs an erase, with the abort code
//! "only in pre-operational state". A restore appends an empty record, so it costs no more than a store.
//!
//! The record:
//!
//! | bytes | field |
//! |---|---|
//! | 0 | version of the record: 1 |
//! | then 7 for each setting: 0, 1 | index |
//! | 2 | sub-index |
//! | 3 to 6 | the value, zero-extended |
//!
//! Settings are found by address, and a record may have any length. So another version of the dictionary reads the
//! settings that it knows. New settings have their defaults. Settings that are unknown or no longer allowed are left
//! out and reported. An address is never reused.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

#[cfg(test)]
extern crate std;

mod pages;

use core::convert::Infallible;
use core::iter;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use wire::dictionary::{self, Place, SETTINGS, index};
use wire::{AbortCode, Address, Settings, Value};

use pages::{Item, Pages};

/// Version of the record.
const VERSION: u8 = 1;

/// Size of a setting in the record, bytes.
const ENTRY: usize = 7;

/// Attempts to read a record. After a power cut its bits can read differently from one time to the next, so a record that
/// was found complete may no longer be so when it is read.
const READS: usize = 10;

/// Size of the record's version, bytes.
const HEAD: usize = 1;

/// Size of the record, bytes.
const RECORD: usize = HEAD + SETTINGS * ENTRY;

/// Origin of loaded settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// The flash.
    Stored,
    /// Defaults, because none were stored or the defaults were restored.
    #[default]
    Blank,
    /// Some or all stored settings cannot be read. Older ones or defaults replace them.
    Corrupted,
    /// Defaults, because the stored settings are incompatible with each other.
    Incompatible,
    /// Defaults, because the stored settings were not read after [`RESETS_UNTIL_DEFAULTS`] in a row.
    NotRead,
    /// The flash, except the learnt values. They have another version, or have decayed, and the foot learns again.
    NotLearnt,
}

/// Consecutive resets by the watchdog after which the stored settings are not read, because they may be the cause.
pub const RESETS_UNTIL_DEFAULTS: u32 = 3;

impl Origin {
    /// Detail of [`Fault::ConfigCorrupted`](wire::Fault::ConfigCorrupted), if the settings in use differ from the
    /// stored ones.
    #[must_use]
    pub const fn fault_detail(self) -> Option<u32> {
        match self {
            Self::Stored | Self::Blank => None,
            Self::Corrupted => Some(0),
            Self::Incompatible => Some(1),
            Self::NotRead => Some(2),
            Self::NotLearnt => Some(3),
        }
    }
}

/// Settings in flash.
pub struct Storage<F: NorFlash> {
    pages: Pages<F>,
}

/// Whether a page of flash may be erased. During an erase, half a second at most, the foot does nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Erase {
    /// The erase is allowed.
    Allowed,
    /// The erase is refused, because the foot is streaming.
    Refused,
}

/// Reason why the settings, the brown-out level or the confirmation of a program could not be written. The previous
/// ones are unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreFailed {
    /// The flash refused the write, or its contents do not read back.
    Flash,
    /// The supply is too low to write flash.
    SupplyLow,
    /// A page must be erased first, and that was not allowed.
    NeedsErase,
}

impl From<Infallible> for StoreFailed {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl StoreFailed {
    /// Detail of [`Fault::ConfigStore`](wire::Fault::ConfigStore).
    #[must_use]
    pub const fn fault_detail(self) -> u32 {
        match self {
            Self::Flash => 0,
            Self::SupplyLow => 1,
            Self::NeedsErase => 2,
        }
    }

    /// Abort code of the request.
    #[must_use]
    pub const fn abort_code(self) -> AbortCode {
        match self {
            Self::Flash | Self::SupplyLow => AbortCode::Hardware,
            Self::NeedsErase => AbortCode::DeviceState,
        }
    }
}

/// Error of a range that does not fit the flash. A range must be at least two whole pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongRange;

impl<F: NorFlash> Storage<F>
where
    StoreFailed: From<F::Error>,
{
    /// Opens the settings in the first two pages of `range`, in bytes from the beginning of `flash`.
    ///
    /// # Errors
    /// The range is less than two pages.
    pub fn new(flash: F, range: &Range<u32>) -> Result<Self, WrongRange> {
        let pages = Pages::new(flash, range).ok_or(WrongRange)?;
        Ok(Self { pages })
    }

    /// Loads the settings at a start after this number of consecutive resets by the watchdog. From
    /// [`RESETS_UNTIL_DEFAULTS`] on they are the defaults. Writes nothing.
    pub fn load_at_start(&mut self, watchdog_resets: u32) -> (Settings, Origin) {
        if watchdog_resets < RESETS_UNTIL_DEFAULTS {
            self.load()
        } else {
            (Settings::default(), Origin::NotRead)
        }
    }

    /// Loads the stored settings, or defaults. Writes nothing.
    pub fn load(&mut self) -> (Settings, Origin) {
        for _ in 0..READS {
            let Ok(latest) = self.pages.newest() else {
                break;
            };
            let Some(item) = latest.item else {
                // Flash that only another program has used was never written here.
                let is_used = latest.has_decayed || !matches!(self.pages.were_used(), Ok(false));
                let origin = if is_used { Origin::Corrupted } else { Origin::Blank };
                return (Settings::default(), origin);
            };
            if let Some((settings, origin)) = self.decode(item) {
                let origin = if latest.has_decayed { Origin::Corrupted } else { origin };
                return (settings, origin);
            }
        }
        (Settings::default(), Origin::Corrupted)
    }

    /// Returns the stored value of a setting, zero-extended, without the dictionary, for which the bootloader has no
    /// room. `None` if the setting is not stored or the record cannot be read.
    pub fn raw_value(&mut self, wanted: Address) -> Option<u32> {
        for _ in 0..READS {
            let item = self.pages.newest().ok()?.item?;
            let mut record = self.pages.record(item);
            let _version = record.read::<HEAD>();
            let found = iter::from_fn(|| record.read()).find(|entry| address_of(entry) == wanted);
            if record.has_checksum_after_rest() {
                return found.map(|[.., v0, v1, v2, v3]| u32::from_le_bytes([v0, v1, v2, v3]));
            }
        }
        None
    }

    /// Stores settings. The previous settings are the older record, and are erased later.
    ///
    /// # Errors
    /// See [`StoreFailed`]. The previous record is unchanged.
    pub fn store(&mut self, settings: &Settings, erase: Erase) -> Result<(), StoreFailed> {
        self.pages.append(&encode(settings), erase)
    }

    /// Deletes the stored settings, so that the next load returns the defaults.
    ///
    /// # Errors
    /// As [`store`](Self::store).
    pub fn restore(&mut self, erase: Erase) -> Result<(), StoreFailed> {
        self.pages.append(&[VERSION], erase)
    }

    /// Flash with the settings.
    pub const fn flash(&mut self) -> &mut F {
        self.pages.flash()
    }

    /// Returns the flash.
    pub fn release(self) -> F {
        self.pages.release()
    }

    /// Settings in a record; `None` if it reads differently than when it was found.
    fn decode(&mut self, item: Item) -> Option<(Settings, Origin)> {
        let mut record = self.pages.record(item);
        let version = record.read::<HEAD>();
        let length = usize::from(item.length).saturating_sub(HEAD);
        let mut unknown = length % ENTRY;
        let mut has_learnt = false;
        let values = iter::from_fn(|| record.read()).filter_map(|entry| {
            let value = setting(&entry);
            unknown += usize::from(value.is_none());
            has_learnt |= value.is_some_and(|(address, value)| {
                address.index == index::LEARNT && value.to_raw() != 0
            });
            value
        });
        let (settings, refused) = Settings::set_all(values);
        let found = match version {
            Some([VERSION]) if length == 0 => (Settings::default(), Origin::Blank),
            Some([VERSION]) if refused > 0 || unknown > 0 => (settings, Origin::Corrupted),
            Some([VERSION]) if has_learnt && settings.learnt().is_none() => {
                (settings, Origin::NotLearnt)
            }
            Some([VERSION]) => (settings, Origin::Stored),
            _ => (Settings::default(), Origin::Corrupted),
        };
        record.has_checksum_after_rest().then_some(found)
    }
}

impl<F: NorFlash> core::fmt::Debug for Storage<F>
where
    StoreFailed: From<F::Error>,
{
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Storage").field("start", &self.pages.start()).finish_non_exhaustive()
    }
}

fn encode(settings: &Settings) -> [u8; RECORD] {
    let mut record = [0; RECORD];
    let [version, entries @ ..] = &mut record;
    *version = VERSION;
    let (entries, _) = entries.as_chunks_mut::<ENTRY>();
    for (entry, (address, value)) in entries.iter_mut().zip(settings.iter()) {
        let [i0, i1] = address.index.to_le_bytes();
        let [v0, v1, v2, v3] = value.to_raw().to_le_bytes();
        *entry = [i0, i1, address.subindex, v0, v1, v2, v3];
    }
    record
}

const fn address_of(&[i0, i1, subindex, ..]: &[u8; ENTRY]) -> Address {
    Address::new(u16::from_le_bytes([i0, i1]), subindex)
}

/// Setting in an entry, if this program has that setting with a matching type.
fn setting(entry: &[u8; ENTRY]) -> Option<(Address, Value)> {
    let (address, &[.., v0, v1, v2, v3]) = (address_of(entry), entry);
    let Ok(Place::Entry(known, Some(_))) = dictionary::find(address) else {
        return None;
    };
    let raw = u32::from_le_bytes([v0, v1, v2, v3]);
    let value = Value::from_raw(known.data_type(), raw)?;
    (value.to_raw() == raw).then_some((address, value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Learnt;
    use pages::tests::{BOARD_PAGE, Flash, holding};
    use std::{vec, vec::Vec};

    fn entry(address: Address, raw: u32) -> [u8; ENTRY] {
        let [i0, i1] = address.index.to_le_bytes();
        let [v0, v1, v2, v3] = raw.to_le_bytes();
        [i0, i1, address.subindex, v0, v1, v2, v3]
    }

    fn settings() -> Settings {
        let mut settings = Settings::default();
        let window = Address::new(index::WINDOW, 0);
        assert_eq!(settings.set(window, Value::U32(30_000)), Ok(()));
        settings
    }

    /// Loads the settings that are found after this record was stored.
    fn load(record: &[u8]) -> (Settings, Origin) {
        let mut pages = holding::<BOARD_PAGE>(vec![0xFF; 2 * BOARD_PAGE]);
        assert_eq!(pages.append(record, Erase::Allowed), Ok(()));
        Storage { pages }.load()
    }

    #[test]
    fn store_failures_have_their_numbers_on_the_wire() {
        for (failed, code, detail) in [
            (StoreFailed::Flash, 0x0606_0000, 0),
            (StoreFailed::SupplyLow, 0x0606_0000, 1),
            (StoreFailed::NeedsErase, 0x0800_0022, 2),
        ] {
            assert_eq!(failed.abort_code().code(), code, "{failed:?}");
            assert_eq!(failed.fault_detail(), detail, "{failed:?}");
        }
    }

    #[test]
    fn golden_bytes_of_a_record() {
        let record = encode(&settings());
        assert_eq!(record.len(), 1 + 7 * SETTINGS);
        assert_eq!(record[0], 1);
        let window = entry(Address::new(index::WINDOW, 0), 30_000);
        assert!(record[1..].as_chunks().0.contains(&window));
        let mut pages = holding::<BOARD_PAGE>(vec![0xFF; 2 * BOARD_PAGE]);
        assert_eq!(pages.append(&[1, 2, 3], Erase::Allowed), Ok(()));
        let expected = [0, 0, 0, 0, 0x1D, 0x80, 0xBC, 0x55, 3, 0, 0xFC, 0xFF, 1, 2, 3, 0, 0xFF];
        assert_eq!(pages.release().bytes[..expected.len()], expected);
    }

    /// Contents that other programs leave: zeros, a littlefs, a FAT, text, and noise.
    fn foreign(kind: usize) -> Vec<u8> {
        let mut random = 0x2545_F491_u32;
        let mut noise = || {
            random ^= random << 13;
            random ^= random >> 17;
            random ^= random << 5;
            random as u8
        };
        let start: &[u8] = match kind {
            0 => &[0; 64],
            1 => b"\x06\0\0\0\xf0\x0f\xff\xf7littlefs\x2f\xe0\0\x10\0\0\x02\0",
            2 => b"\xf8\xff\xff\xff\x03\xf0\xff\x05\x60\0\x07\x80\0\x09\xa0\0",
            3 => b"# SPDX-License-Identifier: MIT\nimport board\nimport digitalio\n",
            _ => &[],
        };
        let fill = |at: usize| start.get(at % 512).copied();
        (0..2 * BOARD_PAGE)
            .map(|at| fill(at).unwrap_or(if kind < 4 { 0 } else { noise() }))
            .collect()
    }

    #[test]
    fn flash_that_other_programs_used_counts_as_blank() {
        for kind in 0..5 {
            let pages = holding::<BOARD_PAGE>(foreign(kind));
            let mut storage: Storage<Flash<BOARD_PAGE>> = Storage { pages };
            assert_eq!(storage.load(), (Settings::default(), Origin::Blank), "{kind}");
            assert_eq!(storage.store(&settings(), Erase::Allowed), Ok(()), "{kind}");
            assert_eq!(storage.load(), (settings(), Origin::Stored), "{kind}");
        }
    }

    #[test]
    fn a_decayed_bit_of_the_only_record_is_reported() {
        let mut pages = holding::<BOARD_PAGE>(vec![0xFF; 2 * BOARD_PAGE]);
        assert_eq!(pages.append(&encode(&settings()), Erase::Allowed), Ok(()));
        let stored = pages.release().bytes;
        let end = stored.iter().rposition(|byte| *byte != 0xFF).expect("a record") + 1;
        for bit in 0..8 * end {
            let mut decayed = stored.clone();
            decayed[bit / 8] ^= 1 << (bit % 8);
            let pages = holding::<BOARD_PAGE>(decayed);
            let found: (Settings, Origin) = Storage::<Flash<BOARD_PAGE>> { pages }.load();
            // One wrong bit in a mark, or in the zeros behind a record, does no harm.
            let is_harmless = found == (settings(), Origin::Stored);
            assert!(is_harmless || found.1 == Origin::Corrupted, "bit {bit}: {:?}", found.1);
        }
    }

    #[test]
    fn a_longer_record_of_a_later_program_gives_known_settings() {
        let mut record = encode(&settings()).to_vec();
        for subindex in 0..150 {
            record.extend(entry(Address::new(0x2FFF, subindex), 7));
        }
        // The omission is reported.
        assert_eq!(load(&record), (settings(), Origin::Corrupted));
        record[0] = 2;
        assert_eq!(load(&record), (Settings::default(), Origin::Corrupted));
    }

    #[test]
    fn a_shorter_record_gives_new_defaults() {
        let record = encode(&settings());
        // A record as stored by a program that lacks the last fourteen settings.
        let shorter = &record[..record.len() - 14 * ENTRY];
        assert_eq!(load(shorter), (settings(), Origin::Stored));
    }

    #[test]
    fn learnt_values_without_version_and_crc_are_not_used() {
        let mut stored = settings();
        let learnt = Learnt::from_array([-1.0, 2.0, -4.5, 4.0, 3.0]);
        assert_eq!(stored.set_learnt(Some(learnt)), Ok(()));
        let record = encode(&stored);
        assert_eq!(load(&record), (stored, Origin::Stored));
        let (entries, _) = record[HEAD..].as_chunks::<ENTRY>();
        let is_seal = |entry: &[u8; ENTRY]| {
            let address = address_of(entry);
            address.index == index::LEARNT && address.subindex > 5
        };
        let kept = entries.iter().filter(|entry| !is_seal(entry)).flatten();
        let older: Vec<u8> = [VERSION].iter().chain(kept).copied().collect();
        let (found, origin) = load(&older);
        assert_eq!((found.learnt(), origin), (None, Origin::NotLearnt));
        let window = Address::new(index::WINDOW, 0);
        assert_eq!(found.get(window), Some(Value::U32(30_000)));
    }

    #[test]
    fn a_value_of_the_wrong_type_is_ignored() {
        let record: Vec<u8> = [VERSION]
            .into_iter()
            .chain(entry(Address::new(index::AUTOSTART, 0), 0x100))
            .chain(entry(Address::new(index::FOOT, 0), 3))
            .collect();
        let (settings, origin) = load(&record);
        assert!(settings.autostart());
        assert_eq!(settings.foot().code(), 3);
        assert_eq!(origin, Origin::Corrupted);
    }

    #[test]
    fn a_truncated_entry_is_ignored_and_reported() {
        let autostart = entry(Address::new(index::AUTOSTART, 0), 0);
        let foot = entry(Address::new(index::FOOT, 0), 3);
        let whole: Vec<u8> = [VERSION].into_iter().chain(foot).chain(autostart).collect();
        for missing in 0..ENTRY {
            // The missing byte is 0, as is the padding of the last word.
            let (settings, origin) = load(&whole[..whole.len() - missing]);
            assert_eq!(settings.foot().code(), 3);
            assert_eq!(settings.autostart(), missing > 0, "{missing} missing");
            let expected = match missing {
                0 => Origin::Stored,
                _ => Origin::Corrupted,
            };
            assert_eq!(origin, expected, "{missing} missing");
        }
    }

    #[test]
    fn a_raw_value_is_found_without_the_dictionary() {
        let mut pages = holding::<BOARD_PAGE>(vec![0xFF; 2 * BOARD_PAGE]);
        let address = Address::new(0x2FFF, 9);
        let record = [&[VERSION][..], &entry(address, 0x1234_5678)].concat();
        assert_eq!(pages.append(&record, Erase::Allowed), Ok(()));
        let mut storage: Storage<Flash<BOARD_PAGE>> = Storage { pages };
        assert_eq!(storage.raw_value(address), Some(0x1234_5678));
        assert_eq!(storage.raw_value(Address::new(0x2FFF, 8)), None);
    }
}
