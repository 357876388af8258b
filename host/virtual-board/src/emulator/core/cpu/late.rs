//! Writes to flash from within a hook, which wait until the engine has stopped, at the end of the block: it rebuilds its
//! map of the memory for each of them, and the access that has called the hook would go on with the old one (a use of
//! freed memory).

use unicorn_engine::Unicorn;

use crate::emulator::memory::{CCM, Memory, RAM, is_memory};

/// Writes that wait, oldest first.
pub(super) type LateWrites = Vec<(u32, Vec<u8>)>;

/// Memory as a hook sees it.
pub(super) struct InHook<'a, 'b> {
    pub(super) engine: &'a mut Unicorn<'b, ()>,
    pub(super) late: &'a mut LateWrites,
}

impl Memory for InHook<'_, '_> {
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
        if !self.engine.read(address, bytes) {
            return false;
        }
        for (start, written) in &*self.late {
            let from = address.max(*start);
            let end = (address + bytes.len() as u32).min(start + written.len() as u32);
            if from < end {
                let (to, of) = ((from - address) as usize, (from - start) as usize);
                let length = (end - from) as usize;
                bytes[to..to + length].copy_from_slice(&written[of..of + length]);
            }
        }
        true
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
        if RAM.holds(address, bytes.len()) || CCM.holds(address, bytes.len()) {
            return self.engine.write(address, bytes);
        }
        if !is_memory(address, bytes.len()) {
            return false;
        }
        self.late.push((address, bytes.to_vec()));
        true
    }
}

/// Applies the writes that wait, once the engine has stopped.
pub(super) fn apply(late: &mut LateWrites, engine: &mut Unicorn<'_, ()>) {
    for (address, bytes) in late.drain(..) {
        engine.write(address, &bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::memory::FLASH;

    #[test]
    fn late_writes_are_read_at_once_and_written_after_the_stop() {
        let mut engine = super::super::engine::with_memory(&[]).expect("an engine");
        let mut late = LateWrites::default();
        let mut memory = InHook { engine: &mut engine, late: &mut late };
        assert!(memory.write(FLASH.start + 2, &[1, 2, 3, 4]));
        assert!(memory.write(FLASH.start + 4, &[5]));
        assert!(!memory.write(FLASH.end(), &[5]));
        assert!(memory.write(RAM.start, &[6]));
        let mut bytes = [0; 8];
        assert!(memory.read(FLASH.start, &mut bytes));
        let expected = [0xFF, 0xFF, 1, 2, 5, 4, 0xFF, 0xFF];
        assert_eq!(bytes, expected);
        assert_eq!(engine.byte(FLASH.start + 2), Some(0xFF));
        assert_eq!(engine.byte(RAM.start), Some(6));
        assert!(!late.is_empty());
        apply(&mut late, &mut engine);
        assert!(late.is_empty());
        assert!(engine.read(FLASH.start, &mut bytes));
        assert_eq!(bytes, expected);
    }
}
