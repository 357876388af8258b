//! The state of a board as seen from outside: counters, faults, memory.

use std::collections::BTreeMap;

use super::Board;
use crate::emulator::machine::{FaultNote, MachineCounters, Profile, Watched};
use crate::emulator::memory::UNTOUCHED;
use crate::emulator::part::rcc::ResetCause;

impl Board {
    /// Instructions, cycles and time so far.
    #[must_use]
    pub fn counters(&self) -> MachineCounters {
        self.cpu.machine().counters()
    }

    /// Architectural faults that the program observed.
    #[must_use]
    pub fn faults(&self) -> Vec<FaultNote> {
        self.cpu.machine().faults.clone()
    }

    /// Resets since power-up: time and cause.
    #[must_use]
    pub fn resets(&self) -> Vec<(u64, ResetCause)> {
        self.cpu.machine().chip.resets.clone()
    }

    /// Number of times each exception was taken.
    #[must_use]
    pub fn exceptions(&self) -> Vec<(u16, u64)> {
        let machine = self.cpu.machine();
        machine.exceptions.clone().into_iter().collect()
    }

    /// Counts the instructions of a function from now on, including its callees and the interrupts during it;
    /// selects the first function whose name contains `part`. Returns false if there is none.
    pub fn watch_function(&mut self, part: &str) -> bool {
        let found = self.function(part);
        self.cpu.machine().watched.extend(found.map(Watched::new));
        found.is_some()
    }

    /// Address of the first function whose name contains `part`.
    pub(super) fn function(&self, part: &str) -> Option<u32> {
        let mut functions = self.image.functions.iter();
        let found = functions.find(|(.., name)| name.contains(part));
        found.map(|(address, ..)| *address)
    }

    /// Instructions of the watched functions, over calls that have returned. Instructions of a watched function
    /// called by another watched one count twice.
    #[must_use]
    pub fn watched_instructions(&self) -> u64 {
        let machine = self.cpu.machine();
        let instructions = machine.watched.iter().map(|watched| watched.instructions);
        instructions.sum()
    }

    /// Counts the instructions of each function from now on.
    pub fn profile_functions(&mut self) {
        self.cpu.machine().profile = Some(Profile::new());
    }

    /// Takes the instructions of each function since the last call of this or [`Self::discard_profile`], without its
    /// callees, the largest first.
    pub fn take_profile(&mut self) -> Vec<(String, u64)> {
        let blocks = self.cpu.machine().profile.as_mut().map(Profile::take);
        let mut functions = BTreeMap::<_, u64>::new();
        for (address, instructions) in blocks.unwrap_or_default() {
            let name = self.image.function_at(address).unwrap_or("?");
            *functions.entry(name).or_default() += instructions;
        }
        let mut functions: Vec<(String, u64)> =
            functions.into_iter().map(|(name, sum)| (name.to_owned(), sum)).collect();
        functions.sort_by_key(|(_, sum)| core::cmp::Reverse(*sum));
        functions
    }

    /// Discards the instructions counted so far.
    pub fn discard_profile(&mut self) {
        if let Some(profile) = &mut self.cpu.machine().profile {
            profile.clear();
        }
    }

    /// Reads memory as a debugger does; `None` if there is no memory.
    pub fn memory(&mut self, address: u32, length: usize) -> Option<Vec<u8>> {
        let mut bytes = vec![0; length];
        self.cpu.memory().read(address, &mut bytes).then_some(bytes)
    }

    /// Maximum depth of the stack between two addresses, bytes from its upper end; a word that was never written
    /// holds [`UNTOUCHED`] or the start-up code's paint.
    pub fn stack_high_water(&mut self, low: u32, high: u32) -> usize {
        const PAINT: [u8; 4] = 0xCCCC_CCCC_u32.to_le_bytes();
        let Some(bytes) = self.memory(low, high.saturating_sub(low) as usize) else {
            return 0;
        };
        let untouched = bytes
            .chunks_exact(4)
            .take_while(|word| *word == PAINT || word.iter().all(|&byte| byte == UNTOUCHED))
            .count();
        bytes.len() - 4 * untouched
    }
}
