//! Settings in flash, with the power cut at every byte.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use firmware::storage::{Origin, Storage};
use wire::dictionary::index;
use wire::{Address, Settings, Value};

use crate::bench::at_once;

const PAGE: usize = 2048;
const PAGES: usize = 2;
const RANGE: std::ops::Range<u32> = 0..(PAGE * PAGES) as u32;

/// Two pages of flash that lose their power after so many bytes. A write clears bits, byte by
/// byte; an erase sets them, byte by byte too.
#[derive(Clone)]
pub struct Flash {
    bytes: Vec<u8>,
    power: u64,
    /// Bytes written and erased so far.
    spent: u64,
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
        Self {
            bytes: vec![0xFF; PAGE * PAGES],
            power: u64::MAX,
            spent: 0,
        }
    }

    fn change(&mut self, at: usize, change: impl FnOnce(u8) -> u8) -> Result<(), PowerCut> {
        self.power = self.power.checked_sub(1).ok_or(PowerCut)?;
        self.spent += 1;
        self.bytes[at] = change(self.bytes[at]);
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = PowerCut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
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

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        (from as usize..to as usize).try_for_each(|at| self.change(at, |_| 0xFF))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        assert_eq!(
            (offset as usize % 4, bytes.len() % 4),
            (0, 0),
            "whole words"
        );
        for (at, new) in (offset as usize..).zip(bytes) {
            // As on the chip: a bit once 0 stays 0 until it is erased.
            self.change(at, |old| old & new)?;
        }
        Ok(())
    }
}

fn storage(flash: Flash) -> Storage<Flash> {
    Storage::new(flash, RANGE).expect("two pages")
}

/// The settings that a start finds.
pub fn load(flash: Flash) -> (Settings, Origin) {
    at_once(storage(flash).load())
}

/// Settings with every half-width and the window at something of their own.
fn settings(number: u32) -> Settings {
    let mut settings = Settings::default();
    for axis in 1..=6 {
        let value = Value::F32(0.1 + number as f32 * 0.01 + f32::from(axis));
        let address = Address::new(index::HALF_WIDTH, axis);
        settings.set(address, value).expect("allowed");
    }
    let window = Value::U32(10_000 + number * 1000);
    settings
        .set(Address::new(index::WINDOW, 0), window)
        .expect("allowed");
    settings
}

/// The flash after a store.
pub fn stored(flash: Flash, settings: &Settings) -> Flash {
    let mut storage = storage(flash);
    at_once(storage.store(settings)).expect("it has power");
    storage.release()
}

#[test]
fn blank_flash_gives_defaults_and_stored_settings_come_back() {
    let flash = Flash::blank();
    assert_eq!(load(flash.clone()), (Settings::default(), Origin::Blank));
    let flash = stored(flash, &settings(1));
    assert_eq!(load(flash.clone()), (settings(1), Origin::Stored));
    let mut storage = storage(flash);
    at_once(storage.restore()).expect("it has power");
    assert_eq!(
        at_once(storage.load()),
        (Settings::default(), Origin::Blank)
    );
}

#[test]
fn a_power_cut_at_any_byte_of_a_store_leaves_the_old_settings_or_the_new() {
    let mut flash = stored(Flash::blank(), &settings(0));
    let (mut cuts, mut erases) = (0, 0);
    // Enough stores to fill both pages and to move on over them.
    for number in 1..=12 {
        let (old, new) = (settings(number - 1), settings(number));
        let spent = flash.spent;
        let next = stored(flash.clone(), &new);
        let cost = next.spent - spent;
        erases += u32::from(cost >= PAGE as u64);
        for cut in 0..cost {
            let mut cut_off = flash.clone();
            cut_off.power = cut;
            let mut storage = storage(cut_off);
            assert!(at_once(storage.store(&new)).is_err());
            let mut survivor = storage.release();
            survivor.power = u64::MAX;
            let (loaded, origin) = load(survivor.clone());
            assert_eq!(
                origin,
                Origin::Stored,
                "cut at byte {cut} of store {number}"
            );
            assert!(
                loaded == old || loaded == new,
                "cut at byte {cut} of store {number}: a mixture"
            );
            // And it can be stored again.
            let again = stored(survivor, &new);
            assert_eq!(
                load(again),
                (new.clone(), Origin::Stored),
                "after cut {cut}"
            );
            cuts += 1;
        }
        flash = next;
    }
    println!("{cuts} power cuts in 12 stores, {erases} of them with an erase");
    assert!(cuts > 6000 && erases >= 2, "{cuts} cuts, {erases} erases");
}

#[test]
fn damaged_flash_gives_sound_settings_and_never_a_panic() {
    let sound = stored(stored(Flash::blank(), &settings(1)), &settings(2));
    let used = sound
        .bytes
        .iter()
        .rposition(|byte| *byte != 0xFF)
        .expect("used");
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
fn a_damaged_only_record_gives_defaults_and_is_reported() {
    let sound = stored(Flash::blank(), &settings(1));
    let used = sound.bytes[..PAGE]
        .iter()
        .rposition(|byte| *byte != 0xFF)
        .expect("used");
    // Behind the marks of the page, which can be restored.
    for at in 8..used {
        let mut flash = sound.clone();
        flash.bytes[at] ^= 0x10;
        let (loaded, origin) = load(flash);
        let untouched = (settings(1), Origin::Stored);
        assert!(
            (loaded.clone(), origin) == untouched
                || (loaded.clone(), origin) == (Settings::default(), Origin::Corrupted),
            "byte {at}: {origin:?}"
        );
    }
    let mut flash = sound;
    flash.bytes[used / 2] ^= 1;
    assert_eq!(load(flash), (Settings::default(), Origin::Corrupted));
}

#[test]
fn a_power_cut_in_the_very_first_store_leaves_defaults() {
    let new = settings(1);
    let cost = stored(Flash::blank(), &new).spent;
    for cut in 1..cost {
        let mut flash = Flash::blank();
        flash.power = cut;
        let mut storage = storage(flash);
        assert!(at_once(storage.store(&new)).is_err());
        let mut flash = storage.release();
        flash.power = u64::MAX;
        let (loaded, _) = load(flash);
        assert!(
            loaded == Settings::default() || loaded == new,
            "cut at byte {cut}"
        );
    }
}

#[test]
fn flash_full_of_anything_can_be_used_again() {
    let mut state = 7_u32;
    for _ in 0..200 {
        let mut flash = Flash::blank();
        for byte in &mut flash.bytes {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (state >> 24) as u8;
        }
        let (loaded, origin) = load(flash.clone());
        assert_eq!(loaded, Settings::default(), "{origin:?}");
        let flash = stored(flash, &settings(3));
        assert_eq!(load(flash), (settings(3), Origin::Stored));
    }
}

#[test]
fn a_range_that_is_not_whole_pages_is_refused() {
    for (start, end) in [(0, PAGE as u32), (0, 100), (4, 4100), (4096, 0)] {
        assert!(Storage::new(Flash::blank(), start..end).is_err());
    }
}
