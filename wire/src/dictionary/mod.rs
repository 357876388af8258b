//! The object dictionary, which defines each object once. The following are made from it: the responses and range
//! checks of the SDO server, the UART's configuration messages, `footfall.eds`, and the tables of `README.md`.
//!
//! | content | module |
//! |---|---|
//! | signatures of the objects, and the look-up | this module |
//! | addresses and indices of the objects | `address`, beside this module |
//! | description of an object: entries, roles, access, limits, texts | `object` |
//! | objects of CiA 301 and 302-3, 0x1000 to 0x1FFF | `communication` |
//! | configuration of the foot, 0x2000 to 0x20FF | `configuration` |
//! | measurements, state and commands of the foot, from 0x2100 on | `process` |
//!
//! To add a number of the estimator, give it a row in [`estimator_core::parameter`] and an entry with
//! `Entry::parameter` in `configuration`. To add another setting, give it an entry with `Entry::setting`, and
//! read it in [`settings`](crate::settings). `FOOTFALL_UPDATE=1 cargo test -p footfall-wire files::` writes
//! the files.

mod communication;
mod configuration;
mod object;
mod process;

use crate::abort::AbortCode;

pub use crate::address::{Address, index};
pub use communication::{ERROR_HISTORY, PDO_NO_REMOTE, PDO_OFF, PRODUCT_CODE, REVISION, VENDOR_ID};
pub(crate) use configuration::AS_QUATERNION;
pub use configuration::{WINDOW_CAPACITY, code_of_axes};
pub use object::{Access, Concern, Entry, Limits, Object, Role, Shape, Text};

/// Result of looking up an address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A value, and its index among the settings if it is one.
    Entry(&'static Entry, Option<usize>),
    /// The highest sub-index of an object.
    Highest(u8),
}

/// Looks up an address.
///
/// # Errors
/// [`AbortCode::NoObject`] and [`AbortCode::NoSubindex`].
pub fn find(address: Address) -> Result<Place, AbortCode> {
    let position = OBJECTS
        .binary_search_by_key(&address.index, |object| object.index)
        .map_err(|_| AbortCode::NoObject)?;
    let (Some(object), Some(&first)) = (OBJECTS.get(position), FIRST_SETTING.get(position)) else {
        return Err(AbortCode::NoObject);
    };
    let mut slot = usize::from(first);
    for entry in object.entries {
        if entry.subindex == address.subindex {
            return Ok(Place::Entry(entry, entry.is_setting().then_some(slot)));
        }
        slot += usize::from(entry.is_setting());
    }
    // An array that is cleared by writing 0 (0x1003) has its count among its entries.
    if address.subindex == 0 {
        Ok(Place::Highest(object.highest_subindex()))
    } else {
        Err(AbortCode::NoSubindex)
    }
}

/// All values, in the order of the addresses.
pub fn entries() -> impl Iterator<Item = (Address, &'static Entry)> {
    OBJECTS.iter().flat_map(|object| {
        let of = move |entry: &'static Entry| (Address::new(object.index, entry.subindex), entry);
        object.entries.iter().map(of)
    })
}

/// All settings, in the order of the addresses.
pub fn settings() -> impl Iterator<Item = (Address, &'static Entry)> {
    entries().filter(|(_, entry)| entry.is_setting())
}

/// Index among the settings of the setting at an address. Only the compiler evaluates it, and it reports a missing
/// setting.
#[allow(clippy::indexing_slicing, clippy::panic)]
pub(crate) const fn slot_of(index: u16, subindex: u8) -> usize {
    let (mut slot, mut i) = (0, 0);
    while i < OBJECTS.len() {
        let object = &OBJECTS[i];
        let mut j = 0;
        while j < object.entries.len() {
            let entry = &object.entries[j];
            if entry.is_setting() && object.index == index && entry.subindex == subindex {
                return slot;
            }
            slot += entry.is_setting() as usize;
            j += 1;
        }
        i += 1;
    }
    panic!("there is no such setting")
}

/// Number of settings.
pub const SETTINGS: usize = count_settings(OBJECTS.len());

/// Number of settings before each object. Only the compiler evaluates it, and it would report an index out of range.
#[allow(clippy::indexing_slicing)]
const FIRST_SETTING: [u16; OBJECTS.len()] = {
    let mut first = [0; OBJECTS.len()];
    let mut i = 0;
    while i < OBJECTS.len() {
        first[i] = count_settings(i) as u16;
        i += 1;
    }
    first
};

#[allow(clippy::indexing_slicing)]
const fn count_settings(objects: usize) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < objects {
        let entries = OBJECTS[i].entries;
        let mut j = 0;
        while j < entries.len() {
            count += entries[j].is_setting() as usize;
            j += 1;
        }
        i += 1;
    }
    count
}

/// All objects, in the order of their indices. The compiler builds the list, and would report an index out of range.
#[allow(clippy::indexing_slicing)]
pub const OBJECTS: &[Object] = &{
    const PARTS: [&[Object]; 3] =
        [communication::OBJECTS, configuration::OBJECTS, process::OBJECTS];
    const COUNT: usize = PARTS[0].len() + PARTS[1].len() + PARTS[2].len();
    let mut all = [PARTS[0][0]; COUNT];
    let (mut count, mut part) = (0, 0);
    while part < PARTS.len() {
        let mut i = 0;
        while i < PARTS[part].len() {
            all[count] = PARTS[part][i];
            count += 1;
            i += 1;
        }
        part += 1;
    }
    all
};

/// "save": signature that must be written to store the settings.
pub const SIGNATURE_STORE: u32 = u32::from_le_bytes(*b"save");
/// "load": signature that must be written to restore the defaults.
pub const SIGNATURE_RESTORE: u32 = u32::from_le_bytes(*b"load");
/// "bor3": signature that must be written to set brown-out level 3 (reset below 2.75 to 2.88 V).
pub const SIGNATURE_BROWN_OUT: u32 = u32::from_le_bytes(*b"bor3");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pdo::PDOS;
    use crate::pdo::Pdo;
    use std::vec::Vec;

    #[test]
    fn entries_are_ordered_by_address() {
        let addresses: Vec<Address> = entries().map(|(address, _)| address).collect();
        assert!(addresses.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn every_entry_is_found_and_each_setting_has_a_slot() {
        let mut slots = Vec::new();
        for (address, entry) in entries() {
            let Ok(Place::Entry(found, slot)) = find(address) else {
                panic!("{address:?} is not found");
            };
            assert_eq!(found, entry);
            assert_eq!(slot.is_some(), entry.is_setting());
            slots.extend(slot);
        }
        assert!(slots.into_iter().eq(0..SETTINGS));
        assert_eq!(settings().count(), SETTINGS);
    }

    #[test]
    fn missing_objects_and_sub_indices_are_reported() {
        assert_eq!(find(Address::new(0x1FFF, 0)), Err(AbortCode::NoObject));
        assert_eq!(find(Address::new(0x1018, 9)), Err(AbortCode::NoSubindex));
        assert_eq!(find(Address::new(0x1018, 0)), Ok(Place::Highest(4)));
        assert_eq!(find(Address::new(0x1800, 0)), Ok(Place::Highest(5)));
    }

    #[test]
    fn defaults_are_within_their_limits() {
        for (address, entry) in settings() {
            assert_eq!(entry.limits().check(entry.default), Ok(()), "{address:?}");
            if let Limits::OneOf(values) = entry.limits() {
                assert!(
                    values
                        .is_sorted_by(|a, b| a.compare(*b).is_some_and(core::cmp::Ordering::is_lt))
                );
            }
        }
    }

    #[test]
    fn mapped_objects_are_mappable_and_have_the_mapped_length() {
        for pdo in Pdo::ALL {
            for mapped in pdo.mapping() {
                let Ok(Place::Entry(entry, _)) = find(mapped.address) else {
                    panic!("{mapped:?} is not found");
                };
                assert!(entry.is_mappable(), "{mapped:?}");
                let size = entry.data_type().size().expect("a number");
                assert_eq!(usize::from(mapped.bits), 8 * size, "{mapped:?}");
            }
        }
        assert_eq!(Pdo::ALL.len(), PDOS);
    }

    #[test]
    fn every_process_value_is_mapped_to_a_pdo() {
        for (address, entry) in entries().filter(|(_, entry)| entry.role == Role::Process) {
            let mapped = Pdo::ALL
                .iter()
                .flat_map(|pdo| pdo.mapping())
                .any(|mapped| mapped.address == address);
            assert!(mapped, "{address:?} {} is in no PDO", entry.name);
        }
    }
}
