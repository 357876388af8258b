//! A foot without a program and without a node id: LSS (`CiA` 305) gives it one, in the bootloader.

use bootloader::flash::Slot;
use bootloader::image::BROKEN_OFF;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::wiring::Wiring;
use wire::dictionary::{PRODUCT_CODE, REVISION, VENDOR_ID, index};

use super::master::{INSTALLED_MS, Master, NEW, START, new_image, sdo};
use crate::common::{MILLISECOND, products};

/// Id that the master assigns.
const ASSIGNED: u8 = 0x2B;

/// Setting of a foot whose id is to come from LSS.
const UNCONFIGURED: u32 = 0xFF;

const REQUEST: u16 = 0x7E5;
const RESPONSE: u32 = 0x7E4;

/// Services of LSS.
const IDENTIFY: u8 = 0x4F;
const FASTSCAN: u8 = 0x51;
const CONFIGURE_NODE_ID: u8 = 0x11;
const SELECT: u8 = 0x40;
const SELECTED: u8 = 0x44;

/// Sends a request of LSS, and returns the answer within 5 ms.
fn ask(master: &mut Master, request: [u8; 8]) -> Option<Vec<u8>> {
    master.board.take_can();
    master.board.push_can(BusFrame::new(REQUEST, &request));
    master.run(5);
    let frames = master.board.take_can();
    let mut answers = frames.into_iter().filter(|sent| sent.frame.id == RESPONSE);
    answers.next().map(|sent| sent.frame.data.as_slice().into())
}

fn with_number(service: u8, number: u32, rest: [u8; 3]) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    let [e, f, g] = rest;
    [service, a, b, c, d, e, f, g]
}

/// Finds the identity of a node without an id, bit by bit, and leaves the node in its configuration; `None` without
/// such a node.
fn fastscan(master: &mut Master) -> Option<[u32; 4]> {
    const FIRST: u8 = 0x80;
    ask(master, with_number(FASTSCAN, 0, [FIRST, 0, 0]))?;
    let mut identity = [0; 4];
    for part in 0..4 {
        let mut number = 0;
        for bit in (0..32).rev() {
            let probe = with_number(FASTSCAN, number, [bit, part, part]);
            if ask(master, probe).is_none() {
                number |= 1 << bit;
            }
        }
        let next = (part + 1) % 4;
        let verify = with_number(FASTSCAN, number, [0, part, if next == 0 { 4 } else { next }]);
        let answer = ask(master, verify).expect("it is whole");
        assert_eq!(answer[0], IDENTIFY);
        identity[usize::from(part)] = number;
    }
    Some(identity)
}

/// Selects a node by its identity.
fn select(master: &mut Master, identity: [u32; 4]) {
    for (service, number) in (SELECT..).zip(identity) {
        let answer = ask(master, with_number(service, number, [0; 3]));
        let expected = (service == SELECTED - 1).then_some(SELECTED);
        assert_eq!(answer.map(|answer| answer[0]), expected);
    }
}

/// Gives the selected node an id, and waits for its boot-up message.
fn configure(master: &mut Master) {
    let answer = ask(master, [CONFIGURE_NODE_ID, ASSIGNED, 0, 0, 0, 0, 0, 0]);
    assert_eq!(answer.expect("an answer")[..2], [CONFIGURE_NODE_ID, 0]);
    master.board.push_can(BusFrame::new(REQUEST, &[4, 0, 0, 0, 0, 0, 0, 0]));
    master.node = ASSIGNED;
    master.boot_up(20);
}

/// Foot whose board has stored that it gets its id by LSS, and has then lost its program.
fn dead_foot(wiring: &'static Wiring, corner: Corner, elf: &[u8]) -> Master {
    let mut master = Master::with(wiring, Some(elf), |options| options.set_corner(corner));
    master.run(500);
    master.pause();
    let set = sdo(0x2F, index::NODE_ID, 0, UNCONFIGURED);
    assert_eq!(master.ask(&set)[0], 0x60);
    master.store();
    let header = Slot::Running.start();
    master.board.cpu().memory().write(header, &[0; 8]);
    master.board.inject(Injection::Reset);
    master.run(3_000);
    let sent = master.board.take_can();
    let heartbeats = sent.iter().filter(|sent| sent.frame.id >> 7 == 0xE);
    assert_eq!(heartbeats.count(), 0, "it has no id to send one");
    master
}

#[test]
#[ignore = "full: updates by LSS of each board, in every corner of the chip"]
fn dead_foot_without_a_node_id_is_found_and_updated() {
    for (wiring, elf) in products() {
        let corners: &[Corner] = match wiring.name {
            "reference" => &Corner::ALL,
            _ => &[Corner::Typical],
        };
        for corner in corners {
            let mut master = dead_foot(wiring, *corner, &elf);
            let identity = fastscan(&mut master).expect("a node without an id");
            let expected = [VENDOR_ID, PRODUCT_CODE, REVISION];
            assert_eq!(identity[..3], expected, "{} {corner:?}", wiring.name);
            configure(&mut master);
            assert_eq!(fastscan(&mut master), None, "it has an id");
            assert_eq!(master.number_at(index::IDENTITY, 4), identity[3]);
            master.install(&new_image(&elf));
            master.run(INSTALLED_MS);
            // The new program has no id either, because the stored settings are unchanged.
            assert_eq!(fastscan(&mut master), Some(identity));
            configure(&mut master);
            assert_eq!(master.version(), NEW);
        }
    }
}

/// Frames of other nodes do not displace a request while the flash is erased, because the bootloader accepts only frames for
/// its new id.
#[test]
#[ignore = "full: an update by LSS beside traffic"]
fn dead_foot_is_selected_and_updated_beside_traffic() {
    let products = products();
    let Some((wiring, elf)) = products.first() else {
        return;
    };
    let mut master = dead_foot(wiring, Corner::Slow, elf);
    let identity = fastscan(&mut master).expect("a node without an id");
    // Not configured, but back to waiting.
    assert_eq!(ask(&mut master, [4, 0, 0, 0, 0, 0, 0, 0]), None);
    master.traffic = 3;
    let mut other = identity;
    other[3] ^= 1;
    for (service, number) in (SELECT..).zip(other) {
        assert_eq!(ask(&mut master, with_number(service, number, [0; 3])), None);
    }
    select(&mut master, identity);
    configure(&mut master);
    // A transfer without its master: after five seconds the slot is erased, for up to two seconds.
    let image = new_image(elf);
    master.begin_with_a_block(&image);
    master.run(4_900);
    master.board.take_can();
    let now = master.board.now();
    for ms in 0..2_000 {
        let at = now + ms * MILLISECOND;
        for id in [0x192, 0x612, 0x592] {
            master.board.push_can_at(BusFrame::new(id, &[0; 8]), at);
        }
        if ms == 500 {
            let read = [0x40, 0x57, 0x1F, 1, 0, 0, 0, 0];
            let request = BusFrame::new(0x600 + u16::from(ASSIGNED), &read);
            master.board.push_can_at(request, at);
        }
    }
    master.traffic = 0;
    let answer = master.answer(4_000).expect("the request was not lost");
    assert_eq!(answer[4..], BROKEN_OFF.to_le_bytes());
    master.traffic = 3;
    assert_eq!(master.send(&image)[0], 0xA1);
    assert_eq!(master.control(START)[0], 0x60);
    master.run(INSTALLED_MS);
    select(&mut master, identity);
    configure(&mut master);
    assert_eq!(master.version(), NEW);
}
