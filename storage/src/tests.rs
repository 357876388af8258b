use super::*;
use pages::tests::{BOARD_PAGE, Flash, holding};
use std::{vec, vec::Vec};
use wire::dictionary::index;

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

/// Loads what is found after this record was stored.
fn load(record: &[u8]) -> (Settings, Origin) {
    let mut pages = holding::<BOARD_PAGE>(vec![0xFF; 2 * BOARD_PAGE]);
    assert_eq!(pages.append(record, Erase::Allowed), Ok(()));
    Storage { pages }.load()
}

#[test]
fn each_store_failure_has_its_abort_code_and_detail() {
    for (failed, code, detail) in [
        (StoreFailed::Flash, AbortCode::Hardware, 0),
        (StoreFailed::SupplyLow, AbortCode::Hardware, 1),
        (StoreFailed::NeedsErase, AbortCode::DeviceState, 2),
    ] {
        assert_eq!(failed.abort_code(), code);
        assert_eq!(failed as u32, detail);
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
    // Everything except the learnt values.
    let shorter = &record[..record.len() - 12 * ENTRY];
    assert_eq!(load(shorter), (settings(), Origin::Stored));
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
