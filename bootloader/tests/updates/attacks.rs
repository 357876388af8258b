//! Attacks with any bytes: headers with one changed bit, random requests, journals that a program has spoilt.

use bootloader::flash::{Flash as _, Slot};
use bootloader::image::{Board, HEADER, Refusal};
use bootloader::journal::{Event, Progress, State};
use bootloader::node::Line;
use bootloader::program;
use bootloader::update::ProgramState::CanRun;
use bootloader::update::{Start, settle};
use bootloader::verify::KEY;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use wire::CanFrame;

use crate::STRIDE;
use crate::download::Master;
use crate::flash::{Chip, header, image, probed};

const NODE: u16 = 5;

/// Sends the header of an image by segments, until the node aborts. Returns whether it has.
fn is_refused(master: &mut Master, header: &[u8], size: u32) -> bool {
    let [a, b, c, d] = size.to_le_bytes();
    let begun = master.send([0x21, 0x50, 0x1F, 1, a, b, c, d]).expect("an answer");
    assert_eq!(begun[0], 0x60);
    header.chunks(7).enumerate().any(|(k, bytes)| {
        let toggle = (k as u8 & 1) << 4;
        let mut request = [toggle | (7 - bytes.len() as u8) << 1, 0, 0, 0, 0, 0, 0, 0];
        request[1..=bytes.len()].copy_from_slice(bytes);
        master.send(request).expect("an answer")[0] == 0x80
    })
}

#[test]
fn header_with_any_changed_bit_is_refused_before_a_write() {
    let new = image(3, 300);
    let mut master = Master::of(Chip::running(&image(2, 200)));
    for bit in (0..8 * HEADER).step_by(STRIDE) {
        let mut header = new[..HEADER].to_vec();
        header[bit / 8] ^= 1 << (bit % 8);
        assert!(is_refused(&mut master, &header, new.len() as u32), "{bit}");
        assert!(master.status().is_some(), "{bit}");
        assert_eq!(master.node.take_restart(), None);
    }
    assert!(!is_refused(&mut master, &new[..HEADER], new.len() as u32));
    assert_eq!(master.node.release().operations, 0, "nothing was written");
}

#[test]
fn foot_with_a_flipped_bit_in_its_header_takes_an_update() {
    let (previous, new) = (image(1, 200), header(&[], 200));
    for running in [image(2, 200), probed(2)] {
        for bit in (0..8 * HEADER).step_by(STRIDE) {
            let mut flipped = running.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            let mut chip = Chip::running(&flipped).with(Slot::Previous, &previous);
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{bit}");
            let expected = match State::read(&chip).refusal {
                None => &flipped,
                Some(why) => {
                    assert_eq!(why, Refusal::Decayed, "{bit}");
                    &previous
                }
            };
            assert!(chip.holds(Slot::Running, expected), "{bit}");
            let found = program::header(&chip, Slot::Running).ok();
            let accepted = new.check(Board::Reference, found.as_ref());
            assert_eq!(accepted, Ok(()), "{bit}");
        }
    }
}

/// Requests of a download in progress, with some of their bytes replaced.
fn hostile(random: &mut SmallRng, image: &[u8]) -> (u16, [u8; 8]) {
    const STARTS: [[u8; 8]; 12] = [
        [0x21, 0x50, 0x1F, 1, 0, 4, 0, 0],
        [0xC6, 0x50, 0x1F, 1, 0, 4, 0, 0],
        [0xC2, 0x50, 0x1F, 1, 0xFF, 0xFF, 0xFF, 0xFF],
        [0x23, 0x50, 0x1F, 1, 1, 2, 3, 4],
        [0x2F, 0x51, 0x1F, 1, 0, 0, 0, 0],
        [0x2F, 0x51, 0x1F, 1, 1, 0, 0, 0],
        [0x2F, 0x51, 0x1F, 1, 3, 0, 0, 0],
        [0x40, 0x57, 0x1F, 1, 0, 0, 0, 0],
        [0xA0, 0x50, 0x1F, 1, 127, 0, 0, 0],
        [0x60, 0, 0, 0, 0, 0, 0, 0],
        [0xC1, 0, 0, 0, 0, 0, 0, 0],
        [0x80, 0x50, 0x1F, 1, 0, 0, 4, 5],
    ];
    let mut request = STARTS[random.random_range(0..STARTS.len())];
    match random.random_range(0..6) {
        // A segment with bytes of an image.
        0..=2 => {
            let at = random.random_range(0..image.len() - 7);
            request = [random.random_range(0..128), 0, 0, 0, 0, 0, 0, 0];
            request[1..].copy_from_slice(&image[at..at + 7]);
        }
        3 => request[random.random_range(0..8)] = random.random(),
        4 => request = random.random(),
        _ => {}
    }
    let ids = [0x600 + NODE, 0x600 + NODE, 0x600 + NODE, 0, 0x7E5];
    let id = ids[random.random_range(0..ids.len())];
    (id, request)
}

#[test]
fn random_requests_neither_run_nor_lose_a_program() {
    let (old, new) = (image(2, 200), image(3, 300));
    let mut chip = Chip::running(&old).with(Slot::Previous, &image(1, 100));
    for seed in 1..=40 {
        let mut random = SmallRng::seed_from_u64(seed);
        let mut node = Master::of(chip).node;
        for _ in 0..3_000 {
            let (id, request) = hostile(&mut random, &new);
            let length = [8, 8, 8, 8, 8, 8, 2, 0][random.random_range(0..8)];
            let frame = CanFrame::new(id, &request[..length]).expect("a frame");
            let line = [Line::Can, Line::Serial][random.random_range(0..2)];
            node.receive(&frame, line);
            for _ in 0..random.random_range(0..4) {
                node.tick(CanRun);
            }
            if node.take_restart().is_some() {
                break;
            }
        }
        chip = node.release();
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{seed}");
        assert!(chip.holds(Slot::Running, &old), "{seed}");
        let state = State::read(&chip);
        assert_eq!(state.progress, Progress::Settled, "{seed}");
    }
}

/// A program can write anything into the journal. The requests in it are executed only with whole programs.
#[test]
fn any_journal_starts_a_whole_program() {
    const EVENTS: [Event; 9] = [
        Event::Install,
        Event::Kept,
        Event::Started,
        Event::Confirmed,
        Event::Restore(Refusal::NotConfirmed),
        Event::Restore(Refusal::Decayed),
        Event::Ended(Refusal::WrongHash),
        Event::Ended(Refusal::NotConfirmed),
        Event::Ended(Refusal::Decayed),
    ];
    let programs = [image(2, 2), image(3, 3), image(1, 1)];
    let [running, new, previous] = &programs;
    for seed in 1..=600 {
        let mut random = SmallRng::seed_from_u64(seed);
        let mut chip = Chip::running(running).with(Slot::Previous, previous);
        let has_new = random.random_range(0..3) > 0;
        if has_new {
            chip = chip.with(Slot::New, new);
        }
        let mut state = State::read(&chip);
        for _ in 0..random.random_range(0..12) {
            let event = EVENTS[random.random_range(0..EVENTS.len())];
            state.append(event, &mut chip).expect("room");
        }
        // An invalid record.
        if random.random_range(0..4) == 0 {
            let at = bootloader::flash::JOURNAL + 4 * random.random_range(0..40);
            let word = chip.read(at) & random.random::<u32>();
            let _ = chip.program(at, word);
        }
        for start in 0..5 {
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{seed} {start}");
            let is_whole = |program: &Vec<u8>| chip.holds(Slot::Running, program);
            assert!(programs.iter().any(is_whole), "{seed} {start}");
        }
    }
}
