//! Pages written by other programs: earlier ones, later ones, and ones with a longer or a shorter record.

use embedded_storage_async::nor_flash as asynchronous;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};
use wire::dictionary::SETTINGS;
use wire::{Settings, Value};

use super::{Flash, Origin, PAGE, PowerCut, RANGE, load, settings, stored};
use crate::bench::at_once;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use wire::Address;
use wire::dictionary::index;

/// The same flash for the library that earlier programs used.
struct Earlier(Flash);

impl asynchronous::ErrorType for Earlier {
    type Error = PowerCut;
}

impl asynchronous::ReadNorFlash for Earlier {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl asynchronous::NorFlash for Earlier {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        self.0.write(offset, bytes)
    }
}

type Map = MapStorage<u8, Earlier, Cache<Uncached, Uncached, Uncached, u8>>;

fn map(flash: Flash) -> Map {
    let config = MapConfig::try_new(RANGE).expect("two pages");
    MapStorage::new(Earlier(flash), config, Cache::new_uncached())
}

/// Content of the flash after another program has stored a record.
fn stored_by_another(flash: Flash, record: &[u8]) -> Flash {
    let mut map = map(flash);
    let mut buffer = [0; PAGE];
    at_once(map.store_item(&mut buffer, &0, &record)).expect("it has power");
    map.destroy().0.0
}

/// Record read by an earlier program, with a sufficient buffer.
fn read_by_another(flash: Flash) -> Option<Vec<u8>> {
    let mut buffer = [0; PAGE];
    let item = at_once(map(flash).fetch_item::<&[u8]>(&mut buffer, &0));
    item.expect("sound").map(<[u8]>::to_vec)
}

fn entry(address: Address, raw: u32) -> [u8; 7] {
    let [i0, i1] = address.index.to_le_bytes();
    let [v0, v1, v2, v3] = raw.to_le_bytes();
    [i0, i1, address.subindex, v0, v1, v2, v3]
}

fn record_of(settings: &Settings) -> Vec<u8> {
    let entries = settings
        .iter()
        .flat_map(|(address, value)| entry(address, value.to_raw()));
    [1].into_iter().chain(entries).collect()
}

#[test]
fn pages_of_an_earlier_program_are_read_and_vice_versa() {
    let (mut by_earlier, mut by_both) = (Flash::blank(), Flash::blank());
    for number in 0..20 {
        let settings = settings(number);
        by_earlier = stored_by_another(by_earlier, &record_of(&settings));
        let read = load(by_earlier.clone());
        assert_eq!(read, (settings.clone(), Origin::Stored), "store {number}");
        // Alternates, so that each finds pages that the other has left.
        by_both = if number % 3 == 1 {
            stored_by_another(by_both, &record_of(&settings))
        } else {
            stored(by_both, &settings)
        };
        assert_eq!(load(by_both.clone()), (settings.clone(), Origin::Stored));
        let record = read_by_another(by_both.clone()).expect("a record");
        let (values, _) = record[1..].as_chunks::<7>();
        let expected = record_of(&settings);
        assert_eq!(values[..SETTINGS].as_flattened(), &expected[1..]);
    }
}

#[test]
fn a_longer_record_of_a_later_program_gives_known_settings() {
    let settings = settings(3);
    let mut record = record_of(&settings);
    for subindex in 0..150 {
        record.extend(entry(Address::new(0x2FFF, subindex), 7));
    }
    for version in [1, 2, 15] {
        record[0] = version;
        let flash = stored_by_another(Flash::blank(), &record);
        // The omission is reported.
        assert_eq!(load(flash), (settings.clone(), Origin::Corrupted));
    }
    record[0] = 16;
    let flash = stored_by_another(Flash::blank(), &record);
    assert_eq!(load(flash), (Settings::default(), Origin::Corrupted));
}

#[test]
fn a_shorter_record_of_an_earlier_program_gives_new_defaults() {
    let settings = settings(4);
    let record = record_of(&settings);
    // Everything except the learnt values.
    let flash = stored_by_another(Flash::blank(), &record[..record.len() - 12 * 7]);
    assert_eq!(load(flash), (settings, Origin::Stored));
}

#[test]
fn an_earlier_slide_speed_of_0_does_not_freeze_learning() {
    let window = (Address::new(index::WINDOW, 0), 30_000);
    let witnesses = [0, 0, 0.05_f32.to_bits(), 0.1_f32.to_bits(), 1];
    let witnesses = (1..).zip(witnesses);
    let witnesses = witnesses.map(|(sub, raw)| (Address::new(index::ESTIMATION, sub), raw));
    let entries = [window].into_iter().chain(witnesses);
    let entries = entries.flat_map(|(address, raw)| entry(address, raw));
    let record: Vec<u8> = [1].into_iter().chain(entries).collect();
    let (settings, origin) = load(stored_by_another(Flash::blank(), &record));
    let defaults = Settings::default();
    assert_eq!(settings.learning(), defaults.learning());
    assert_eq!(settings.method(), defaults.method());
    assert_eq!(settings.get(window.0), Some(Value::U32(30_000)));
    assert_eq!(origin, Origin::Corrupted);
}

#[test]
fn a_value_of_the_wrong_type_is_ignored() {
    let record: Vec<u8> = [1]
        .into_iter()
        .chain(entry(Address::new(index::AUTOSTART, 0), 0x100))
        .chain(entry(Address::new(index::FOOT, 0), 3))
        .collect();
    let (settings, origin) = load(stored_by_another(Flash::blank(), &record));
    assert!(settings.autostart());
    assert_eq!(settings.foot().code(), 3);
    assert_eq!(origin, Origin::Corrupted);
}

#[test]
fn a_truncated_entry_is_ignored_and_reported() {
    let autostart = entry(Address::new(index::AUTOSTART, 0), 0);
    let foot = entry(Address::new(index::FOOT, 0), 3);
    let whole: Vec<u8> = [1].into_iter().chain(foot).chain(autostart).collect();
    for missing in 0..7 {
        // The missing byte is 0, as is the padding of the last word.
        let record = &whole[..whole.len() - missing];
        let (settings, origin) = load(stored_by_another(Flash::blank(), record));
        assert_eq!(settings.foot().code(), 3);
        assert_eq!(settings.autostart(), missing > 0, "{missing} missing");
        let expected = if missing == 0 {
            Origin::Stored
        } else {
            Origin::Corrupted
        };
        assert_eq!(origin, expected, "{missing} missing");
    }
}
