//! Settings in flash, with the power cut at every byte.

use std::ops::Range;

use ::storage::{Erase, Origin, Storage, StoreFailed};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use wire::dictionary::index;
use wire::{Address, Settings, Value};

use crate::STRIDE;

const PAGE: usize = 2048;
const PAGES: usize = 2;
const RANGE: Range<u32> = 0..(PAGE * PAGES) as u32;

/// Two pages of flash that lose power after N bytes. A write clears bits, byte by byte; an erase sets them, byte
/// by byte too.
#[derive(Clone)]
pub struct Flash {
    bytes: Vec<u8>,
    power: u64,
    /// Number of bytes written and erased so far.
    spent: u64,
    /// Failed bits that remain cleared: the bits of the mask, in these bytes.
    dead: (Range<usize>, u8),
}

#[derive(Debug)]
pub struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    pub fn blank() -> Self {
        Self { bytes: vec![0xFF; PAGE * PAGES], power: u64::MAX, spent: 0, dead: (0..0, 0) }
    }

    fn change(&mut self, at: usize, change: impl FnOnce(u8) -> u8) -> Result<(), PowerCut> {
        self.power = self.power.checked_sub(1).ok_or(PowerCut)?;
        self.spent += 1;
        self.bytes[at] = change(self.bytes[at]);
        if self.dead.0.contains(&at) {
            self.bytes[at] &= !self.dead.1;
        }
        Ok(())
    }
}

impl From<PowerCut> for StoreFailed {
    fn from(_: PowerCut) -> Self {
        Self::Flash
    }
}

impl ErrorType for Flash {
    type Error = PowerCut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        (from as usize..to as usize).try_for_each(|at| self.change(at, |_| 0xFF))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        assert_eq!((offset as usize % 4, bytes.len() % 4), (0, 0), "whole words");
        for (at, new) in (offset as usize..).zip(bytes) {
            // As on the chip: a cleared bit stays 0 until it is erased.
            self.change(at, |old| old & new)?;
        }
        Ok(())
    }
}

fn storage(flash: Flash) -> Storage<Flash> {
    Storage::new(flash, &RANGE).expect("two pages")
}

/// Settings found at a start.
pub fn load(flash: Flash) -> (Settings, Origin) {
    storage(flash).load()
}

/// Settings with individual values of every half-width and the window.
fn settings(number: u32) -> Settings {
    let mut settings = Settings::default();
    for axis in 1..=6 {
        let value = Value::F32(0.1 + number as f32 * 0.01 + f32::from(axis) * 0.2);
        let address = Address::new(index::HALF_WIDTH, axis);
        settings.set(address, value).expect("allowed");
    }
    let window = Value::U32(10_000 + number * 1000);
    settings.set(Address::new(index::WINDOW, 0), window).expect("allowed");
    settings
}

/// Content of the flash after a store.
pub fn stored(flash: Flash, settings: &Settings) -> Flash {
    let mut storage = storage(flash);
    storage.store(settings, Erase::Allowed).expect("it has power");
    storage.release()
}

#[test]
fn blank_flash_gives_defaults_and_stores_are_restored() {
    let flash = Flash::blank();
    assert_eq!(load(flash.clone()), (Settings::default(), Origin::Blank));
    let flash = stored(flash, &settings(1));
    assert_eq!(load(flash.clone()), (settings(1), Origin::Stored));
    let mut storage = storage(flash);
    storage.restore(Erase::Allowed).expect("it has power");
    assert_eq!(storage.load(), (Settings::default(), Origin::Blank));
}

#[test]
fn a_power_cut_in_a_store_leaves_the_old_or_new_settings() {
    let mut flash = Flash::blank();
    let mut old = Settings::default();
    let (mut cuts, mut erases) = (0, 0);
    // These are enough stores to fill both pages and to continue over them.
    for number in 0..=12 {
        let new = settings(number);
        let next = stored(flash.clone(), &new);
        let cost = next.spent - flash.spent;
        erases += u32::from(cost >= PAGE as u64);
        for cut in (0..cost).step_by(STRIDE) {
            let at = format!("cut at byte {cut} of store {number}");
            let mut cut_off = flash.clone();
            cut_off.power = cut;
            let mut before = storage(cut_off);
            assert!(before.store(&new, Erase::Allowed).is_err());
            let mut survivor = before.release();
            survivor.power = u64::MAX;
            let mut after = storage(survivor.clone());
            let (loaded, origin) = after.load();
            // Before the first store, a load finds no settings.
            assert!(number == 0 || origin == Origin::Stored, "{at}");
            assert!(loaded == old || loaded == new, "{at}: a mixture");
            let read = after.release();
            let is_unchanged = read.bytes == survivor.bytes && read.spent == survivor.spent;
            assert!(is_unchanged, "{at}: changed by a load");
            // The settings can be stored again.
            assert_eq!(load(stored(survivor, &new)), (new.clone(), Origin::Stored));
            cuts += 1;
        }
        (flash, old) = (next, new);
    }
    assert!(cuts > 6000 / STRIDE && erases >= 2, "{cuts} cuts, {erases} erases");
}

#[test]
fn damaged_flash_gives_valid_settings_without_a_panic() {
    let sound = stored(stored(Flash::blank(), &settings(1)), &settings(2));
    let used = sound.bytes.iter().rposition(|byte| *byte != 0xFF).expect("used");
    let mut origins = [0; 3];
    for at in 0..=used {
        for damage in [0x01, 0x80, 0xFF] {
            let mut flash = sound.clone();
            flash.bytes[at] ^= damage;
            let (loaded, origin) = load(flash.clone());
            origins[origin as usize] += 1;
            let known = [Settings::default(), settings(1), settings(2)];
            assert!(known.contains(&loaded), "byte {at}: {loaded:?}");
            let again = stored(flash, &settings(3));
            assert_eq!(load(again), (settings(3), Origin::Stored), "byte {at}");
        }
    }
    println!("stored, blank, corrupted: {origins:?}");
    assert_eq!(origins[Origin::Blank as usize], 0);
}

#[test]
fn a_range_of_partial_pages_is_rejected() {
    for (start, end) in [(0, PAGE as u32), (0, 100), (4, 4100), (4096, 0)] {
        assert!(Storage::new(Flash::blank(), &(start..end)).is_err());
    }
}

/// Flash whose active page has no room for another record, and whose other page is full too.
fn both_full() -> (Flash, Settings) {
    let mut flash = stored(Flash::blank(), &settings(0));
    let mut erases = 0;
    for number in 1.. {
        let (before, next) = (flash.clone(), stored(flash, &settings(number)));
        erases += u32::from(next.spent - before.spent >= PAGE as u64);
        if erases == 2 {
            return (before, settings(number - 1));
        }
        flash = next;
    }
    unreachable!("some store erases");
}

#[test]
fn a_store_or_restore_that_must_erase_is_rejected_if_forbidden() {
    let (full, last) = both_full();
    let mut storage = storage(full.clone());
    let new = settings(100);
    assert_eq!(storage.store(&new, Erase::Refused), Err(StoreFailed::NeedsErase));
    assert_eq!(storage.load(), (last, Origin::Stored));
    assert_eq!(storage.store(&new, Erase::Allowed), Ok(()));
    assert_eq!(storage.load(), (new.clone(), Origin::Stored));
    // The next page is used without an erase.
    assert_eq!(storage.store(&settings(101), Erase::Refused), Ok(()));
    assert_eq!(storage.restore(Erase::Refused), Ok(()));
    assert_eq!(storage.load(), (Settings::default(), Origin::Blank));
}

#[test]
fn a_worn_bit_moves_the_record_and_two_are_reported() {
    let old = stored(Flash::blank(), &settings(1));
    let begin = old.bytes.iter().rposition(|byte| *byte != 0xFF);
    let begin = begin.expect("something is stored") + 1;
    let new = settings(2);
    let record = (stored(old.clone(), &new).spent - old.spent) as usize;
    let mut moved = 0;
    for at in begin..begin + record {
        for bit in 0..8 {
            let dead = (at..at + 1, 1 << bit);
            let flash = stored(Flash { dead, ..old.clone() }, &new);
            moved += usize::from(flash.spent - old.spent > record as u64);
            let bytes = flash.bytes.clone();
            assert_eq!(load(flash), (new.clone(), Origin::Stored), "byte {at}");
            // The store also succeeds if the bit was cleared before.
            let mut worn = old.clone();
            worn.bytes[at] &= !(1 << bit);
            let worn = stored(worn, &new);
            assert_eq!(load(worn), (new.clone(), Origin::Stored), "byte {at}");
            assert!(bytes[..begin] == old.bytes[..begin]);
        }
    }
    // Many bits are to be cleared anyway.
    assert!(moved > record, "{moved} moved");
    // If no bit holds, the failure is reported, and the old settings remain.
    let mut flash = old;
    flash.bytes[begin + 8..PAGE - 4].fill(0);
    flash.dead = (PAGE + 4..2 * PAGE - 4, 0x01);
    let mut storage = storage(flash);
    let result = storage.store(&new, Erase::Allowed);
    assert_eq!(result, Err(StoreFailed::Flash));
    assert_eq!(storage.load().0, settings(1));
}

#[test]
fn a_decayed_newest_record_is_reported_and_the_previous_used() {
    let older = stored(Flash::blank(), &settings(1));
    let newer = stored(older.clone(), &settings(2));
    let used = |flash: &Flash| flash.bytes.iter().rposition(|byte| *byte != 0xFF);
    let (from, to) = (used(&older), used(&newer));
    let (from, to) = (from.expect("used") + 1, to.expect("used"));
    // After the start and the header, before the padding of the last word.
    for at in from + 12..to - 3 {
        let mut flash = newer.clone();
        flash.bytes[at] ^= 0x04;
        assert_eq!(load(flash), (settings(1), Origin::Corrupted), "byte {at}");
    }
    // No other record is valid.
    let mut flash = older;
    flash.bytes[from / 2] ^= 1;
    assert_eq!(load(flash), (Settings::default(), Origin::Corrupted));
}
