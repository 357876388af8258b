//! The chip around the core (stub).
use crate::core::nvic::Nvic;
use crate::machine::Memory;
use crate::time;

/// What a peripheral may need to act.
pub struct Context<'a> {
    /// Virtual time.
    pub now: u64,
    /// Memory, for DMA.
    pub memory: &'a mut dyn Memory,
}

/// x
#[derive(Default)]
pub struct Chip {}

#[allow(missing_docs, clippy::unused_self)]
impl Chip {
    pub fn period(&self) -> u64 { time::cycle(16_000_000) }
    pub fn reset(&mut self, _now: u64) {}
    pub fn advance(&mut self, _c: &mut Context) -> Result<(), String> { Ok(()) }
    pub fn drive_lines(&mut self, _n: &mut Nvic) {}
    pub fn take_flash_changed(&mut self) -> bool { false }
    pub fn take_reset_request(&mut self) -> bool { false }
    pub fn take_stall(&mut self) -> u64 { 0 }
    pub fn next_event(&self) -> u64 { time::NEVER }
    pub fn read(&mut self, _c: &mut Context, _a: u32, _s: usize) -> Result<u32, String> { Err("not modelled".into()) }
    pub fn write(&mut self, _c: &mut Context, _a: u32, _s: usize, _v: u32) -> Result<(), String> { Err("not modelled".into()) }
    pub fn note_software_reset(&mut self) {}
}
