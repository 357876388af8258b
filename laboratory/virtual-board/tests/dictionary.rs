//! Reads and writes every entry of the dictionary with its boundary values, over CAN, in every state of the node:
//! each request is answered, a rejected value is rejected with the reason, each value that the settings allow is accepted
//! and reads back, and the board continues.

use crate::common::product;
use crate::common::rig::{Rig, STOP};
use wire::dictionary::{self, Access, Entry, Limits, PDO_OFF, Role, index};
use wire::{AbortCode, Address, Settings, Value};

/// Id of the node, which the identifier of a PDO contains.
const NODE: u32 = 0x11;

/// Time limit of an answer, and of an answer to an action, ms.
const PROMPT_MS: u64 = 20;
const DONE_MS: u64 = 5_000;

/// Values at the ends of a range and beyond them, as bytes.
fn values(entry: &Entry) -> Vec<Vec<u8>> {
    let width = bytes(entry.default).len();
    let near = |value: Value| {
        let raw = value.to_raw();
        [raw, raw.wrapping_sub(1), raw.wrapping_add(1)]
    };
    let mut raws = vec![0, 1, u32::MAX, 0x7F, 0x80, 0x7FFF, 0x8000, 1 << 31, i32::MAX as u32];
    raws.extend(near(entry.default));
    // Floats: NaN, both infinities, the smallest.
    raws.extend([0x7FC0_0000, 0x7F80_0000, 0xFF80_0000, 1]);
    if entry.role == Role::PdoCobId {
        raws.extend([on_the_bus(entry), on_the_bus(entry) ^ PDO_OFF]);
    }
    match entry.limits() {
        Limits::Any => {}
        Limits::Range(low, high) => raws.extend([low, high].into_iter().flat_map(near)),
        Limits::RangeWithout(ends) => raws.extend(ends.iter().copied().flat_map(near)),
        Limits::OneOf(all) => raws.extend(all.iter().copied().flat_map(near)),
    }
    let mut all: Vec<Vec<u8>> =
        raws.into_iter().map(|raw| raw.to_le_bytes()[..width].to_vec()).collect();
    // Values of another length.
    all.extend([1, 2, 3, 4].map(|length| vec![1; length]));
    all.retain(|data| !data.is_empty());
    all.sort();
    all.dedup();
    all
}

/// Default of an entry as it is read and written.
fn on_the_bus(entry: &Entry) -> u32 {
    let of_node = matches!(entry.role, Role::CobId | Role::PdoCobId);
    entry.default.to_raw() + if of_node { NODE } else { 0 }
}

/// Result of a write to a board with the default settings; `None` if it depends on the state of the board.
fn expected(
    address: Address,
    entry: &Entry,
    data: &[u8],
    may_set: bool,
) -> Option<Result<(), AbortCode>> {
    if !matches!(entry.access, Access::Wo | Access::Rw) {
        return Some(Err(AbortCode::ReadOnly));
    }
    let Some(value) = Value::from_bytes(entry.data_type(), data) else {
        let is_longer = data.len() > bytes(entry.default).len();
        return Some(Err(if is_longer { AbortCode::TooLong } else { AbortCode::TooShort }));
    };
    match entry.role {
        Role::Setting(_) | Role::PdoCobId if !may_set => Some(Err(AbortCode::DeviceState)),
        Role::Setting(_) => Some(Settings::default().set(address, value)),
        Role::PdoCobId => {
            let without_node = Value::U32(value.to_raw().wrapping_sub(NODE));
            Some(Settings::default().set(address, without_node))
        }
        Role::Command => entry.limits().check(value).err().map(Err),
        _ => Some(entry.limits().check(value)),
    }
}

fn bytes(value: Value) -> Vec<u8> {
    let size = value.data_type().size().unwrap_or(0);
    value.to_raw().to_le_bytes()[..size].to_vec()
}

fn request(command: u8, address: Address, data: &[u8]) -> [u8; 8] {
    let [low, high] = address.index.to_le_bytes();
    let mut request = [command, low, high, address.subindex, 0, 0, 0, 0];
    for (to, from) in request[4..].iter_mut().zip(data) {
        *to = *from;
    }
    request
}

fn write(address: Address, data: &[u8]) -> [u8; 8] {
    let unused = 4 - data.len().min(4) as u8;
    request(0x23 | unused << 2, address, data)
}

/// Result of a write by its answer.
fn result(answer: &[u8; 8]) -> Result<(), AbortCode> {
    let [command, _, _, _, a, b, c, d] = *answer;
    let code = u32::from_le_bytes([a, b, c, d]);
    match command {
        0x60 => Ok(()),
        0x80 => Err(AbortCode::from_code(code).unwrap_or_else(|| panic!("abort {code:#010x}"))),
        _ => panic!("{answer:02x?}"),
    }
}

const fn is_abort(answer: &[u8; 8]) -> bool {
    answer[0] == 0x80
}

/// Returns whether writing the entry starts an action by a signature that is not tested here, or ends a
/// precondition of the test.
fn is_left_out(address: Address, data: &[u8]) -> bool {
    let signatures = [dictionary::SIGNATURE_STORE, dictionary::SIGNATURE_RESTORE];
    signatures.iter().any(|word| data == word.to_le_bytes())
        || address.index == index::LOCK
        // Stops or resets the program: `tests/update`.
        || matches!((address.index, data), (index::PROGRAM_CONTROL, [0 | 2]))
}

/// Tests all entries in the current state of the node. Returns the number of requests, and of settings that were accepted.
fn walk(rig: &mut Rig, may_set: bool) -> (usize, usize) {
    let (mut requests, mut accepted) = (0, 0);
    for (address, entry) in dictionary::entries() {
        let name = format!("{:04X}:{}", address.index, address.subindex);
        let read = request(0x40, address, &[]);
        let answer = rig.ask(read, PROMPT_MS).unwrap_or_else(|| panic!("{name}: no answer"));
        assert_eq!(is_abort(&answer), entry.access == Access::Wo, "{name}: read {answer:02x?}");
        let deadline_ms = match entry.role {
            Role::Command => DONE_MS,
            _ => PROMPT_MS,
        };
        for data in values(entry) {
            if is_left_out(address, &data) {
                continue;
            }
            requests += 1;
            let answer = rig
                .ask(write(address, &data), deadline_ms)
                .unwrap_or_else(|| panic!("{name}: no answer to {data:02x?}"));
            let result = result(&answer);
            if let Some(expected) = expected(address, entry, &data, may_set) {
                assert_eq!(result, expected, "{name}: {data:02x?}");
            }
            if result.is_ok() && entry.is_setting() {
                accepted += 1;
                let answer = rig.ask(read, PROMPT_MS).expect("an answer");
                assert_eq!(answer[4..4 + data.len()], data[..], "{name} reads back");
                let default = on_the_bus(entry).to_le_bytes();
                let back = rig.ask(write(address, &default[..data.len()]), PROMPT_MS);
                assert!(back.is_some_and(|answer| !is_abort(&answer)), "{name}: default");
            }
        }
    }
    (requests, accepted)
}

#[test]
fn boundary_values_of_all_entries_are_answered_in_every_state() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(1_000);
    let (operational, accepted) = walk(&mut rig, false);
    assert_eq!(accepted, 0, "a setting changed while process data flow");
    rig.pre_operational();
    let (pre_operational, accepted) = walk(&mut rig, true);
    println!("{operational} and {pre_operational} requests, {accepted} settings");
    // Each setting accepts its default, and most settings another value as well.
    assert!(accepted > 2 * dictionary::settings().count(), "{accepted}");
    rig.nmt(STOP);
    rig.run(5);
    for (address, entry) in dictionary::entries() {
        let silent = [request(0x40, address, &[]), write(address, &bytes(entry.default))];
        for request in silent {
            assert_eq!(rig.ask(request, 2), None, "{address:?} in stopped");
        }
    }
    rig.operational();
    rig.run(500);
    let (_, contacts) = rig.watch(1_000);
    assert!(contacts > 990, "estimates go on");
    assert_eq!(rig.resets(), []);
    assert_eq!(rig.board.faults(), []);
}
