//! Runs the engine until it stops, and handles the reason.

use unicorn_engine::{Prot, RegisterARM};

use super::{CoreState, Cpu, late};
use crate::emulator::block::Block;
use crate::emulator::core::nvic::exception;
use crate::emulator::core::scb::cfsr;
use crate::emulator::failure::Failure;
use crate::emulator::machine::{RunningBlock, Stop};
use crate::emulator::memory::{Memory, RAM};

const WFI: u16 = 0xBF30;
const WFE: u16 = 0xBF20;
const YIELD: u16 = 0xBF10;
const SEMIHOSTING: u16 = 0xBEAB;

/// Ends the run at an instruction.
fn failed(pc: u32, what: impl Into<String>) -> Result<(), Failure> {
    Err(Failure::new(pc, None, what))
}

impl Cpu {
    /// Runs the engine until a hook stops it, and handles the reason.
    pub(super) fn run_blocks(&mut self) -> Result<(), Failure> {
        self.machine.borrow_mut().stop = None;
        let start = self.get(RegisterARM::PC);
        let result = self.engine.emu_start(u64::from(start | 1), 0, 0, 0);
        self.write_deferred();
        let pc = self.get(RegisterARM::PC);
        let stop = self.machine.borrow_mut().stop.take();
        // The current block, up to where it stopped.
        let block = self.finish_block(pc, &stop);
        match stop {
            // A store continues to the end of its block, and the bus refuses it afterwards.
            Some(Stop::Boundary) => {}
            Some(Stop::Store { address }) => {
                self.fault(pc, exception::BUS_FAULT, cfsr::IMPRECISERR, Some(address));
            }
            Some(Stop::Load { address }) => {
                let status = cfsr::PRECISERR | cfsr::BFARVALID;
                self.fault(pc, exception::BUS_FAULT, status, Some(address));
            }
            Some(Stop::FetchFault) => {
                if pc >= 0xFFFF_FF00 {
                    self.leave(pc);
                } else if RAM.contains(pc) && !self.runs_from_ram.replace(true) {
                    // Stores to executable memory are slow, so it is enabled on first use only.
                    let (start, size) = (u64::from(RAM.start), RAM.size as u64);
                    (self.engine.mem_protect(start, size, Prot::ALL))
                        .or_else(|error| failed(pc, format!("{error:?}")))?;
                } else {
                    self.fault(pc, exception::BUS_FAULT, cfsr::IBUSERR, None);
                }
            }
            Some(Stop::NoFloat { instructions, offset }) => {
                self.without_float(instructions, offset)?;
            }
            Some(Stop::Exception(7)) => self.breakpoint(pc)?,
            Some(Stop::Exception(8)) => self.leave(pc),
            Some(Stop::Exception(22)) => self.usage_fault(pc, cfsr::UNALIGNED),
            Some(Stop::Exception(number)) => {
                return failed(pc, format!("the engine stopped with {number}"));
            }
            Some(Stop::Invalid) => {
                let last = self.half(pc.wrapping_sub(2));
                let at_end = block.is_some_and(|(address, size)| address + size == pc);
                if self.get(RegisterARM::EPSR) & 0x0100_0000 == 0 {
                    self.usage_fault(pc, cfsr::INVSTATE);
                } else if at_end && last == WFE {
                    if !core::mem::take(&mut self.event) {
                        self.state = CoreState::WaitingForEvent;
                    }
                } else if !(at_end && last == YIELD) {
                    self.usage_fault(pc, cfsr::UNDEFINSTR);
                }
            }
            None => match result {
                Ok(()) if self.half(pc.wrapping_sub(2)) == WFI => {
                    self.state = CoreState::WaitingForInterrupt;
                }
                Ok(()) => {}
                Err(error) => return failed(pc, format!("the engine failed: {error:?}")),
            },
        }
        Ok(())
    }

    /// Charges the block that was running when the engine stopped. Returns its start and length.
    fn finish_block(&mut self, pc: u32, stop: &Option<Stop>) -> Option<(u32, u32)> {
        let mut machine = self.machine.borrow_mut();
        let block = machine.running.take()?;
        let whole = !matches!(
            stop,
            Some(Stop::Load { .. } | Stop::FetchFault | Stop::Exception(7 | 22) | Stop::Invalid)
        ) || pc < block.address
            || pc >= block.address + block.block.size;
        let mut ran = block;
        if !whole {
            ran.block = Block::at(&mut self.engine, block.address, pc - block.address);
        }
        self.event |= machine.charge(&ran, pc);
        self.event |= core::mem::take(&mut machine.event_sent);
        Some((block.address, block.block.size))
    }

    /// Applies the writes that hooks have deferred; the engine has stopped.
    fn write_deferred(&mut self) {
        late::apply(&mut self.late.borrow_mut(), &mut self.engine);
    }

    /// Handles a floating-point instruction while the unit is off: runs up to it, then faults.
    fn without_float(&mut self, instructions: u32, offset: u32) -> Result<(), Failure> {
        let start = self.get(RegisterARM::PC);
        let pc = start + offset;
        if instructions > 0 {
            self.machine.borrow_mut().allow_float = true;
            let result = self.engine.emu_start(u64::from(start | 1), 0, 0, instructions as usize);
            self.write_deferred();
            let mut machine = self.machine.borrow_mut();
            machine.allow_float = false;
            machine.stop = None;
            machine.running = None;
            let block = Block::at(&mut self.engine, start, offset);
            let address = start;
            machine.charge(&RunningBlock { address, block }, pc);
            result.or_else(|error| failed(start, format!("{error:?}")))?;
        }
        self.usage_fault(pc, cfsr::NOCP);
        Ok(())
    }

    /// Handles a breakpoint: a semihosting call, or an error.
    fn breakpoint(&mut self, pc: u32) -> Result<(), Failure> {
        if self.half(pc) != SEMIHOSTING {
            return failed(pc, "a breakpoint, and no debugger");
        }
        let (r0, r1) = (self.get(RegisterARM::R0), self.get(RegisterARM::R1));
        let answer = {
            let mut machine = self.machine.borrow_mut();
            machine.count_instruction();
            machine.semihosting.call(&mut self.engine, r0, r1)
        };
        let Some(answer) = answer else {
            return failed(pc, format!("semihosting call {r0:#x}"));
        };
        self.set(RegisterARM::R0, answer);
        self.set(RegisterARM::PC, (pc + 2) | 1);
        Ok(())
    }

    /// Reads two bytes of code.
    fn half(&mut self, address: u32) -> u16 {
        let mut bytes = [0; 2];
        self.engine.read(address, &mut bytes);
        u16::from_le_bytes(bytes)
    }
}
