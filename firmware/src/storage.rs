//! Settings in flash: two pages, one record, the newest complete one counts.
//!
//! The record is appended to a page by `sequential-storage`, which checks it by CRC-32, moves to
//! the other page when one is full, and repairs what a power cut left behind: whatever byte a cut
//! falls on, the next load gives the settings from before or from after the write, never a mixture.
//! Likewise where a record decays: the one before it counts, if it is still there.
//! Only about one store in thirty erases a page; where the flash stalls the processor meanwhile,
//! that is the one that costs ticks.
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
//! Of no-panic: `sequential-storage` holds asserts and unwraps, so this module is outside the proof
//! that covers estimator, driver and wire. It runs below the sampling loop; tests feed it every cut
//! and every damaged byte.
//!
//! Settings are found by address, so another version of the dictionary reads what it knows: what is
//! new has its default, what is no longer allowed is left out and reported.

use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};
use wire::dictionary::{self, Place, SETTINGS};
use wire::{Address, Settings, Value};

use crate::ports::StoreFailed;

/// The version of the record.
const VERSION: u8 = 1;

/// Bytes of a setting in the record.
const ENTRY: usize = 7;

/// Bytes of the record.
const RECORD: usize = 1 + SETTINGS * ENTRY;

/// Room for the key, the record and its rounding up to the flash's words.
const BUFFER: usize = (1 + RECORD).next_multiple_of(32) + 32;

/// The one key of the map.
const KEY: u8 = 0;

/// Where loaded settings come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// They were stored.
    Stored,
    /// Nothing was: defaults.
    Blank,
    /// What was stored cannot be read, or not all of it: defaults stand for the rest.
    Corrupted,
}

/// Flash with settings in it.
pub struct Storage<F: NorFlash> {
    map: MapStorage<u8, F, Cache<Uncached, Uncached, Uncached, u8>>,
}

/// The range does not fit the flash: it must be at least two whole pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongRange;

impl<F: NorFlash> core::fmt::Debug for Storage<F> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let range = self.map.flash_range();
        f.debug_struct("Storage")
            .field("range", &range)
            .finish_non_exhaustive()
    }
}

impl<F: NorFlash> Storage<F> {
    /// Settings in the pages of `range`, in bytes from the beginning of `flash`.
    ///
    /// # Errors
    /// The range is not two or more pages.
    pub fn new(flash: F, range: Range<u32>) -> Result<Self, WrongRange> {
        if range.end < range.start {
            return Err(WrongRange);
        }
        let config = MapConfig::try_new(range).map_err(|_| WrongRange)?;
        Ok(Self {
            map: MapStorage::new(flash, config, Cache::new_uncached()),
        })
    }

    /// The stored settings, or defaults.
    pub async fn load(&mut self) -> (Settings, Origin) {
        let mut buffer = [0; BUFFER];
        match self.map.fetch_item::<&[u8]>(&mut buffer, &KEY).await {
            Ok(Some(record)) => decode(record),
            // A damaged record is passed over as if it were not there; here it would be missed.
            Ok(None) if self.is_blank().await => (Settings::default(), Origin::Blank),
            Ok(None) => (Settings::default(), Origin::Corrupted),
            Err(_) => (Settings::default(), Origin::Corrupted),
        }
    }

    /// Whether nothing was ever written since the pages were erased.
    async fn is_blank(&mut self) -> bool {
        const CHUNK: usize = 64;
        let range = self.map.flash_range();
        let flash = self.map.flash();
        let mut chunk = [0; CHUNK];
        for offset in range.step_by(CHUNK) {
            let read = flash.read(offset, &mut chunk).await;
            if read.is_err() || chunk.iter().any(|byte| *byte != 0xFF) {
                return false;
            }
        }
        true
    }

    /// Stores settings. What was there before is the older record, and forgotten in time.
    ///
    /// # Errors
    /// The flash refused; what was stored before is still there.
    pub async fn store(&mut self, settings: &Settings) -> Result<(), StoreFailed> {
        let mut record = [0; RECORD];
        let length = encode(settings, &mut record);
        let record = record.get(..length).ok_or(StoreFailed)?;
        let mut buffer = [0; BUFFER];
        if self
            .map
            .store_item(&mut buffer, &KEY, &record)
            .await
            .is_err()
        {
            // Not repairable: begin anew.
            self.map.erase_all().await.map_err(|_| StoreFailed)?;
            let stored = self.map.store_item(&mut buffer, &KEY, &record).await;
            stored.map_err(|_| StoreFailed)?;
        }
        Ok(())
    }

    /// Forgets what was stored, so that the defaults apply from the next load.
    ///
    /// # Errors
    /// The flash refused.
    pub async fn restore(&mut self) -> Result<(), StoreFailed> {
        self.map.erase_all().await.map_err(|_| StoreFailed)
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.map.destroy().0
    }
}

/// Writes the record; returns its length.
fn encode(settings: &Settings, record: &mut [u8; RECORD]) -> usize {
    let (version, entries) = match record.split_first_mut() {
        Some(parts) => parts,
        None => return 0,
    };
    *version = VERSION;
    let (entries, _) = entries.as_chunks_mut::<ENTRY>();
    let mut length = 1;
    for (entry, (address, value)) in entries.iter_mut().zip(settings.iter()) {
        let [i0, i1] = address.index.to_le_bytes();
        let [v0, v1, v2, v3] = value.to_raw().to_le_bytes();
        *entry = [i0, i1, address.subindex, v0, v1, v2, v3];
        length += ENTRY;
    }
    length
}

fn decode(record: &[u8]) -> (Settings, Origin) {
    let Some((&VERSION, entries)) = record.split_first() else {
        return (Settings::default(), Origin::Corrupted);
    };
    let (entries, rest) = entries.as_chunks::<ENTRY>();
    let mut unknown = 0;
    let values = entries.iter().filter_map(|entry| {
        let value = setting(entry);
        unknown += usize::from(value.is_none());
        value
    });
    let (settings, refused) = Settings::set_all(values);
    let sound = refused == 0 && unknown == 0 && rest.is_empty();
    let origin = if sound {
        Origin::Stored
    } else {
        Origin::Corrupted
    };
    (settings, origin)
}

fn setting(&[i0, i1, subindex, v0, v1, v2, v3]: &[u8; ENTRY]) -> Option<(Address, Value)> {
    let address = Address::new(u16::from_le_bytes([i0, i1]), subindex);
    let Ok(Place::Entry(entry, Some(_))) = dictionary::find(address) else {
        return None;
    };
    let raw = u32::from_le_bytes([v0, v1, v2, v3]);
    Some((address, Value::from_raw(entry.data_type(), raw)?))
}
