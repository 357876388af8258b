//! A flash in memory whose supply fails in a chosen operation, and programs for it.

use std::cell::Cell;

use bootloader::flash::{Flash, FlashFailed, JOURNAL, JOURNAL_SIZE, SLOT_SIZE, Sector, Slot};
use bootloader::image::{Board, HASHED, HEADER, Header, Kind, MARK, SIGNED, Sources};
use bootloader::journal::{Event, State};
use bootloader::update::{Start, settle};
use bootloader::verify::{Hash, KEY};

/// Private half of the development key.
pub const DEVELOPMENT: &[u8; 32] = include_bytes!("../../keys/development.key");

/// How an operation that the power cut interrupts leaves the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Not begun.
    Before,
    /// Some bits of a word, or all of a sector but its beginning.
    Within,
    /// Completed.
    After,
}

pub const CUTS: [Cut; 3] = [Cut::Before, Cut::Within, Cut::After];

/// Journal and slots.
#[derive(Clone)]
pub struct Chip {
    words: Vec<u32>,
    pub operations: u32,
    /// Operation in which the supply fails.
    pub cut: Option<(u32, Cut)>,
    /// Bad cell that always reads 0: the address of its word, and the bit.
    pub bad_cell: Option<(u32, u32)>,
    /// Largest number of times that a sector was erased.
    pub erases: Cell<u32>,
}

impl Chip {
    pub fn blank() -> Self {
        let size = (JOURNAL_SIZE + 3 * SLOT_SIZE) / 4;
        Self {
            words: vec![u32::MAX; size as usize],
            operations: 0,
            cut: None,
            bad_cell: None,
            erases: Cell::new(0),
        }
    }

    /// Chip that runs a program, which is confirmed.
    pub fn running(image: &[u8]) -> Self {
        let mut chip = Self::blank().with(Slot::Running, image);
        chip.log(Event::Confirmed);
        chip.operations = 0;
        chip
    }

    /// Appends an event to the journal, which has room for it. An install is requested as by a master.
    pub fn log(&mut self, event: Event) {
        let mut state = State::read(self);
        let appended = match event {
            Event::Install => state.install(self),
            _ => state.append(event, self),
        };
        appended.expect("room");
    }

    /// Asserts that a start, which may install, runs this program.
    #[track_caller]
    pub fn runs(&mut self, image: &[u8]) {
        assert_eq!(settle(self, KEY), Ok(Start::Program));
        assert!(self.holds(Slot::Running, image), "another program");
    }

    /// This chip with a program in a slot.
    pub fn with(mut self, slot: Slot, image: &[u8]) -> Self {
        for (at, word) in (slot.start()..).step_by(4).zip(image.chunks(4)) {
            *self.word(at) = u32::from_le_bytes(word.try_into().expect("whole words"));
        }
        self
    }

    /// The supply is back.
    pub fn power_up(&mut self) {
        self.cut = None;
    }

    /// Clears bits of a word, as decay does.
    pub fn decay(&mut self, address: u32) {
        *self.word(address) &= 0x0FFF_00FF;
    }

    /// Clears the bit in the header of a slot that distinguishes a program that was sent from one written by a probe.
    pub fn decay_kind(&mut self, slot: Slot) {
        *self.word(slot.start() + 8) &= !0x100;
    }

    /// Returns whether a slot holds a program, whose mark does not matter.
    pub fn holds(&self, slot: Slot, image: &[u8]) -> bool {
        (slot.start()..)
            .step_by(4)
            .zip(image.chunks(4))
            .filter(|(at, _)| *at != slot.start() + MARK as u32)
            .all(|(at, word)| self.read(at).to_le_bytes() == word)
    }

    fn word(&mut self, address: u32) -> &mut u32 {
        assert!(address.is_multiple_of(4), "{address:#x}");
        &mut self.words[((address - JOURNAL) / 4) as usize]
    }

    /// How the next operation ends, and whether it is reported.
    fn operate(&mut self) -> Result<Option<Cut>, FlashFailed> {
        self.operations += 1;
        match self.cut {
            Some((at, _)) if self.operations > at => Err(FlashFailed),
            Some((at, cut)) if self.operations == at => Ok(Some(cut)),
            _ => Ok(None),
        }
    }
}

impl Flash for Chip {
    fn read(&self, address: u32) -> u32 {
        self.words[((address - JOURNAL) / 4) as usize]
    }

    fn program(&mut self, address: u32, word: u32) -> Result<(), FlashFailed> {
        let cut = self.operate()?;
        let old = self.read(address);
        *self.word(address) = match cut {
            None | Some(Cut::After) => old & word,
            Some(Cut::Within) => old & (word | 0x5A5A_5A5A),
            Some(Cut::Before) => old,
        };
        if let Some((at, bit)) = self.bad_cell
            && at == address
        {
            *self.word(at) &= !bit;
        }
        match cut {
            None if self.read(address) == word => Ok(()),
            _ => Err(FlashFailed),
        }
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFailed> {
        self.erases.set(self.erases.get() + 1);
        let cut = self.operate()?;
        let (start, size) = match sector {
            Sector::Journal => (JOURNAL, JOURNAL_SIZE),
            Sector::Slot(slot) => (slot.start(), SLOT_SIZE),
        };
        let all = start..start + size;
        // Only the header remains.
        let erased = match cut {
            None | Some(Cut::After) => all,
            Some(Cut::Within) => start + HEADER as u32..start + size,
            Some(Cut::Before) => start..start,
        };
        let words = |at: u32| ((at - JOURNAL) / 4) as usize;
        self.words[words(erased.start)..words(erased.end)].fill(u32::MAX);
        if let Some((at, bit)) = self.bad_cell {
            *self.word(at) &= !bit;
        }
        match cut {
            None => Ok(()),
            Some(_) => Err(FlashFailed),
        }
    }
}

/// Header of a program without its signature.
pub fn header(program: &[u8], sequence: u32) -> Header {
    let mut header = Header {
        kind: Kind::Signed,
        board: Board::Reference,
        length: program.len() as u32,
        sequence,
        version: [0, 1, 0],
        sources: Sources::Committed,
        commit: [0xC0; 20],
        hash: [0; 32],
        signature: [0; 64],
    };
    let mut hash = Hash::new();
    hash.update(program);
    hash.update(&header.encode()[..HASHED]);
    header.hash = hash.finish();
    header
}

/// Image of a program with this header, signed with a private key.
pub fn sign(mut header: Header, program: &[u8], key: &[u8; 32]) -> Vec<u8> {
    let pair = salty::Keypair::from(key);
    header.signature = pair.sign(&header.encode()[..SIGNED]).to_bytes();
    let mut image = header.encode().to_vec();
    image.extend(program);
    image
}

/// Program of `length` bytes that differs from the programs of other seeds.
pub fn program(seed: u8, length: usize) -> Vec<u8> {
    (0..length).map(|k| (k as u8).wrapping_mul(31) ^ seed).collect()
}

/// Signed image of a program.
pub fn image(seed: u8, sequence: u32) -> Vec<u8> {
    let program = program(seed, 400 + 4 * usize::from(seed));
    sign(header(&program, sequence), &program, DEVELOPMENT)
}

/// Image as a probe writes it: with a header that has no hash.
pub fn probed(seed: u8) -> Vec<u8> {
    let program = program(seed, 600);
    let header = Header {
        kind: Kind::Probed,
        length: 0,
        hash: [0xFF; 32],
        signature: [0xFF; 64],
        ..header(&program, 0)
    };
    let mut image = header.encode().to_vec();
    assert_eq!(image.len(), HEADER);
    image.extend(program);
    image
}
