//! Reads and writes every entry of the dictionary with its boundary values, over CAN, in every state of the node:
//! each request is answered, a rejected value is rejected with the reason, an accepted value reads back, and the
//! board continues.

use crate::common::product;
use crate::common::rig::{Rig, STOP};
use wire::dictionary::{self, Access, Entry, Limits, Role, index};
use wire::{Address, Value};

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

/// Tests all entries in the current state of the node. Returns the number of requests.
fn walk(rig: &mut Rig, may_set: bool) -> usize {
    let mut requests = 0;
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
            let taken = !is_abort(&answer);
            assert!(answer[0] == 0x60 || !taken, "{name}: {answer:02x?}");
            let value = Value::from_bytes(entry.data_type(), &data);
            let allowed = value.is_some_and(|value| entry.limits().check(value).is_ok());
            let is_writable = matches!(entry.access, Access::Wo | Access::Rw);
            assert!(!taken || allowed && is_writable, "{name}: {data:02x?} was taken");
            let is_setting = matches!(entry.role, Role::Setting(_) | Role::PdoCobId);
            assert!(
                !taken || !is_setting || may_set,
                "{name}: a setting changed while process data flow"
            );
            if taken && matches!(entry.role, Role::Setting(_)) {
                let answer = rig.ask(read, PROMPT_MS).expect("an answer");
                assert_eq!(answer[4..4 + data.len()], data[..], "{name} reads back");
                let back = rig.ask(write(address, &bytes(entry.default)), PROMPT_MS);
                assert!(back.is_some_and(|answer| !is_abort(&answer)), "{name}: default");
            }
        }
    }
    requests
}

#[test]
fn boundary_values_of_all_entries_are_answered_in_every_state() {
    let Some(elf) = product() else { return };
    let mut rig = Rig::new(&elf);
    rig.run(1_000);
    let operational = walk(&mut rig, false);
    rig.pre_operational();
    let pre_operational = walk(&mut rig, true);
    println!("{operational} and {pre_operational} requests");
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
