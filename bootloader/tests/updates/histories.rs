//! Random histories of starts, confirmations and updates, with power cuts and a journal near its end: at every moment a
//! slot holds a whole program that has worked.

use std::cell::RefCell;

use bootloader::device::Device;
use bootloader::flash::{Flash, FlashFailed, JOURNAL, JOURNAL_SIZE, SLOT_SIZE, Sector, Slot};
use bootloader::image::{Board, MARK};
use bootloader::journal::{Event, MOST_STARTS, Progress, State};
use bootloader::update::ProgramState::Missing;
use bootloader::update::{Start, settle};
use bootloader::verify::KEY;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use wire::dictionary::{Address, index};
use wire::domain::Domains;
use wire::sdo::Objects;

use crate::STRIDE;
use crate::flash::{image, probed};

const PROGRAM_DATA: Address = Address::new(index::PROGRAM_DATA, 1);
const PROGRAM_CONTROL: Address = Address::new(index::PROGRAM_CONTROL, 1);

/// Word of a header that is no part of a program.
const MARK_WORD: usize = MARK / 4;

/// Effect of a power cut on the bits that an operation was changing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bits {
    /// Each has its old or its new value.
    Firm,
    /// Some read differently each time, until they are programmed or erased again.
    WeakPerRead,
    /// Some bits read differently from one power-up to the next, until they are programmed or erased again.
    WeakPerPowerUp,
}

/// Flash whose supply fails in a random operation and leaves random contents.
#[derive(Clone)]
struct Part {
    words: Vec<u32>,
    /// Bits that read differently.
    weak: Vec<u32>,
    bits: Bits,
    /// Number of this power-up, counted over all histories.
    power_up: u64,
    random: RefCell<SmallRng>,
    /// Number of operations until the supply fails.
    until_cut: Option<u32>,
    programs: Programs,
}

/// Programs and their past.
#[derive(Clone, Default)]
struct Programs {
    images: Vec<Vec<u8>>,
    /// Programs that have begun to confirm themselves: they work.
    work: Vec<bool>,
    /// Whether a program has completed its confirmation. From then on the board has a program that works.
    has_worked: bool,
    /// First violation of the invariant.
    lost: Option<String>,
}

const fn place(address: u32) -> usize {
    ((address - JOURNAL) / 4) as usize
}

impl Part {
    fn new(seed: u64, bits: Bits, images: &[Vec<u8>]) -> Self {
        let size = place(JOURNAL + JOURNAL_SIZE + 3 * SLOT_SIZE);
        Self {
            words: vec![u32::MAX; size],
            weak: vec![0; size],
            bits,
            power_up: seed << 32,
            random: RefCell::new(SmallRng::seed_from_u64(seed)),
            until_cut: None,
            programs: Programs {
                images: images.to_vec(),
                work: vec![false; images.len()],
                ..Programs::default()
            },
        }
    }

    fn put(&mut self, slot: Slot, program: usize) {
        let words = self.programs.images[program].chunks(4);
        for (at, bytes) in (place(slot.start())..).zip(words) {
            self.words[at] = u32::from_le_bytes(bytes.try_into().expect("whole words"));
        }
    }

    fn below(&self, limit: u32) -> u32 {
        self.random.borrow_mut().random_range(0..limit)
    }

    fn any(&self) -> u32 {
        self.random.borrow_mut().random()
    }

    /// Index of the program that a slot holds whole, without a weak bit.
    fn program_in(&self, slot: Slot) -> Option<usize> {
        let start = place(slot.start());
        self.programs.images.iter().position(|image| {
            image.chunks(4).enumerate().all(|(k, bytes)| {
                k == MARK_WORD
                    || self.weak[start + k] == 0
                        && self.words[start + k].to_le_bytes().as_slice() == bytes
            })
        })
    }

    /// Notes a moment in which no slot holds a program that works.
    fn watch(&mut self, operation: &str) {
        let works = |slot| self.program_in(slot).is_some_and(|k| self.programs.work[k]);
        let is_safe = works(Slot::Running) || works(Slot::Previous);
        if self.programs.has_worked && !is_safe && self.programs.lost.is_none() {
            self.programs.lost = Some(operation.into());
        }
    }

    /// Returns whether the supply fails in this operation.
    fn operate(&mut self) -> Result<bool, FlashFailed> {
        match &mut self.until_cut {
            None => Ok(false),
            Some(0) => Err(FlashFailed),
            Some(left) => {
                *left -= 1;
                Ok(*left == 0)
            }
        }
    }

    /// Leaves a word between two values.
    fn leave(&mut self, at: usize, old: u32, new: u32) {
        let changing = old ^ new;
        // The supply fails early, late, or between.
        let (changed, weak) = match self.below(4) {
            0 => (0, self.few()),
            1 => (changing, self.few()),
            _ => (changing & self.any(), self.any() & self.any()),
        };
        self.words[at] = old ^ changed;
        if self.bits != Bits::Firm {
            self.weak[at] |= changing & weak;
        }
    }

    /// One to three bits.
    fn few(&self) -> u32 {
        (0..=self.below(3)).fold(0, |bits, _| bits | 1 << self.below(u32::BITS))
    }

    /// Lets the bits that are weak have other values.
    const fn power_up(&mut self) {
        self.power_up += 1;
    }

    /// Values of the weak bits of a word.
    fn noise(&self, at: usize) -> u32 {
        match self.bits {
            Bits::Firm => 0,
            Bits::WeakPerRead => self.any(),
            Bits::WeakPerPowerUp => {
                let seed = self.power_up.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ at as u64;
                SmallRng::seed_from_u64(seed).random()
            }
        }
    }

    /// Lets the supply fail in one of the next operations, or not.
    fn arm(&mut self) {
        self.until_cut = match self.below(6) {
            0 => Some(1 + self.below(8)),
            1 => Some(1 + self.below(1_500)),
            // The journal has 16,384 words.
            2 => Some(1 + self.below(17_000)),
            _ => None,
        };
    }

    /// Returns whether the supply has failed, and brings it back.
    fn take_cut(&mut self) -> bool {
        self.power_up();
        self.until_cut.take() == Some(0)
    }

    /// Fills the journal up to `rest` records: with updates while the running program is confirmed, otherwise with records
    /// that power cuts have damaged.
    fn fill(&mut self, rest: u32) {
        // The records of an update: install, kept, started, confirmed.
        const UPDATE: [u32; 4] = [1, 6, 2, 3];
        let is_settled = State::read(self).progress == Progress::Settled;
        let mut update = UPDATE.into_iter().cycle();
        let blank = (0..(JOURNAL_SIZE / 8).saturating_sub(rest)).map(|k| place(JOURNAL + 8 * k));
        let blank: Vec<usize> =
            blank.filter(|at| self.words[*at..=at + 1] == [u32::MAX; 2]).collect();
        // The last update is complete.
        let count = blank.len() / UPDATE.len() * UPDATE.len();
        for at in blank.into_iter().take(count) {
            let word = update.next().unwrap_or_default();
            let record = if is_settled { [word, !word] } else { [0; 2] };
            self.words[at..=at + 1].copy_from_slice(&record);
            self.weak[at..=at + 1].fill(0);
        }
    }

    /// Downloads an image and asks for its start, as a master does. Returns whether all was taken.
    fn download(self, program: usize) -> (Self, bool) {
        let image = self.programs.images[program].clone();
        let mut device = Device::new(self, Board::Reference, 1, KEY);
        device.find_running(Missing(None));
        let taken = (|| {
            device.write(PROGRAM_CONTROL, &[3])?;
            device.begin(PROGRAM_DATA, Some(image.len() as u32))?;
            for bytes in image.chunks(127 * 7) {
                device.append(bytes)?;
                device.flush()?;
            }
            device.end()?;
            device.write(PROGRAM_CONTROL, &[1])
        })();
        (device.flash, taken.is_ok())
    }

    /// The running program confirms itself, if it is on trial.
    fn confirm(&mut self) {
        let Some(program) = self.program_in(Slot::Running) else {
            return;
        };
        let mut state = State::read(self);
        if matches!(state.progress, Progress::Trial(_)) {
            self.programs.work[program] = true;
            if state.append(Event::Confirmed, self).is_ok() {
                self.programs.has_worked = true;
            }
        }
    }

    /// Asserts that a start runs a program that works wherever the journal calls it confirmed.
    #[track_caller]
    fn assert_settled_works(&self, context: &str) {
        if State::read(self).progress == Progress::Settled {
            let running = self.program_in(Slot::Running);
            let works = running.is_some_and(|program| self.programs.work[program]);
            assert!(works, "{context}: a program is settled without a trial");
        }
    }

    /// Asserts that a board whose programs are never confirmed again returns to one that works.
    #[track_caller]
    fn assert_comes_back(&self, context: &str) {
        let mut part = self.clone();
        part.until_cut = None;
        for _ in 0..MOST_STARTS + 2 {
            part.power_up();
            let start = settle(&mut part, KEY);
            if part.programs.has_worked {
                assert_eq!(start, Ok(Start::Program), "{context}");
            }
        }
        let running = part.program_in(Slot::Running);
        let works = running.is_some_and(|program| part.programs.work[program]);
        assert!(works || !part.programs.has_worked, "{context}: runs {running:?}");
        assert_eq!(part.programs.lost, None, "{context}");
    }
}

impl Flash for Part {
    fn read(&self, address: u32) -> u32 {
        let at = place(address);
        let (word, weak) = (self.words[at], self.weak[at]);
        if weak == 0 { word } else { word ^ (weak & self.noise(at)) }
    }

    fn program(&mut self, address: u32, word: u32) -> Result<(), FlashFailed> {
        let at = place(address);
        let is_cut = self.operate()?;
        let old = self.words[at];
        match (is_cut, self.below(3)) {
            (true, 0) => {}
            (true, 1) => self.leave(at, old, old & word),
            _ => {
                self.words[at] = old & word;
                // Bits that are programmed again are firm.
                self.weak[at] &= word;
            }
        }
        self.watch("program");
        if !is_cut && self.read(address) == word { Ok(()) } else { Err(FlashFailed) }
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFailed> {
        let is_cut = self.operate()?;
        let (start, size) = match sector {
            Sector::Journal => (JOURNAL, JOURNAL_SIZE),
            Sector::Slot(slot) => (slot.start(), SLOT_SIZE),
        };
        let (start, size) = (place(start), size as usize / 4);
        let kind = if is_cut { self.below(7) } else { 0 };
        let split = self.below(size as u32) as usize;
        for k in 0..size {
            let at = start + k;
            let old = self.words[at];
            let is_erased = match kind {
                0 => true,
                1 => false,
                2 => k < split,
                3 => k >= split,
                4 => self.below(2) == 0,
                // Almost complete: some words are left.
                5 => self.below(5_000) != 0,
                _ => {
                    self.leave(at, old, u32::MAX);
                    continue;
                }
            };
            if is_erased {
                (self.words[at], self.weak[at]) = (u32::MAX, 0);
            } else if kind == 5 {
                self.words[at] = u32::MAX;
                self.weak[at] = if self.bits == Bits::Firm { 0 } else { !old & self.few() };
            }
        }
        self.watch("erase");
        if is_cut { Err(FlashFailed) } else { Ok(()) }
    }
}

/// Runs a history, and asserts after each step that nothing is lost.
fn run(seed: u64, bits: Bits, images: &[Vec<u8>]) {
    let mut part = Part::new(seed, bits, images);
    let mut steps = Vec::new();
    // One in three boards begins with the program of a probe.
    if part.below(3) == 0 {
        part.put(Slot::Running, 0);
        (part.programs.work[0], part.programs.has_worked) = (true, true);
    }
    for _ in 0..24 {
        let step = part.below(8);
        part.arm();
        steps.push((step, part.until_cut));
        match step {
            0 => {
                let rest = part.below(90);
                part.fill(rest);
            }
            1 | 2 => {
                let program = 1 + part.below(images.len() as u32 - 1);
                let taken;
                (part, taken) = part.download(program as usize);
                steps.push((100 + program, Some(u32::from(taken))));
            }
            _ => {
                let start = settle(&mut part, KEY);
                let context = format!("{seed}: {steps:?}");
                if start == Ok(Start::Program) && part.until_cut != Some(0) {
                    part.assert_settled_works(&context);
                    if step < 6 {
                        part.confirm();
                    }
                }
            }
        }
        part.take_cut();
        let context = format!("{seed}: {steps:?}");
        assert_eq!(part.programs.lost, None, "{context}");
        part.assert_comes_back(&context);
    }
}

/// Runs histories, and asserts that none loses a program.
fn run_all(seeds: impl Iterator<Item = u64>, bits: Bits) {
    let mut images = vec![probed(0)];
    images.extend((1..6).map(|seed| image(seed, 7)));
    let seeds: Vec<u64> = seeds.collect();
    let failed: Vec<String> = seeds
        .iter()
        .filter_map(|&seed| {
            let ended = std::panic::catch_unwind(|| run(seed, bits, &images));
            ended.err().map(|why| why.downcast_ref::<String>().cloned().unwrap_or_default())
        })
        .collect();
    assert!(failed.is_empty(), "{} of {}: {failed:#?}", failed.len(), seeds.len());
}

/// The supply fails in a confirmation, so that its record reads as valid at one start and not at the next. It fails
/// again in the first starts of the install of another program.
#[test]
fn weak_confirmation_leaves_a_way_back() {
    let images: Vec<_> = (1..4).map(|seed| image(seed, 7)).collect();
    for seed in (30_000..30_200).step_by(STRIDE) {
        let mut part = Part::new(seed, Bits::WeakPerPowerUp, &images);
        for (slot, program) in [(Slot::Previous, 0), (Slot::Running, 1), (Slot::New, 2)] {
            part.put(slot, program);
        }
        (part.programs.work[0], part.programs.work[1], part.programs.has_worked) =
            (true, true, true);
        for event in [Event::Install, Event::Kept, Event::Started, Event::Confirmed] {
            State::read(&part).append(event, &mut part).expect("room");
        }
        let confirmed = part.words.iter().rposition(|word| *word == 3).expect("a record");
        part.weak[confirmed] = 1 << 31;
        part.power_up();
        State::read(&part).install(&mut part).expect("room");
        for _ in 0..2 {
            part.power_up();
            part.until_cut = Some(1 + part.below(300));
            let _ = settle(&mut part, KEY);
            part.take_cut();
        }
        part.assert_comes_back(&format!("{seed}"));
    }
}

#[test]
fn histories_keep_a_program_that_works() {
    run_all((0..100).step_by(STRIDE), Bits::Firm);
}

#[test]
fn histories_with_bits_weak_per_read_keep_a_program() {
    run_all((10_000..10_100).step_by(STRIDE), Bits::WeakPerRead);
}

#[test]
fn histories_with_bits_weak_per_power_up_keep_a_program() {
    run_all((20_000..20_100).step_by(STRIDE), Bits::WeakPerPowerUp);
}

#[test]
#[ignore = "full: 900 more histories"]
fn many_histories_keep_a_program_that_works() {
    run_all(100..1_000, Bits::Firm);
}

#[test]
#[ignore = "full: 2,000 more histories"]
fn many_histories_with_bits_weak_per_read_keep_a_program() {
    run_all(10_100..12_100, Bits::WeakPerRead);
}

#[test]
#[ignore = "full: 2,000 more histories"]
fn many_histories_with_bits_weak_per_power_up_keep_a_program() {
    run_all(20_100..22_100, Bits::WeakPerPowerUp);
}
