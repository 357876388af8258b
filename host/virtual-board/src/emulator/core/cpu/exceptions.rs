//! Exception entry and return: frames, vectors, faults (ARMv7-M, B1.5).

use unicorn_engine::{RegisterARM, Unicorn};

use super::{CoreState, Cpu};
use crate::emulator::core::nvic::{THREAD, exception};
use crate::emulator::core::scb::{FORCED, VECTTBL, cfsr};
use crate::emulator::machine::Machine;
use crate::emulator::memory::{CCM, FLASH, Memory, RAM};

pub(super) const FLOATS: [RegisterARM; 8] = {
    use RegisterARM::{D0, D1, D2, D3, D4, D5, D6, D7};
    [D0, D1, D2, D3, D4, D5, D6, D7]
};

/// The registers that an exception stacks before the return address and the program status, in this order.
const STACKED: [RegisterARM; 6] = {
    use RegisterARM::{LR, R0, R1, R2, R3, R12};
    [R0, R1, R2, R3, R12, LR]
};

/// Cycles from an exception's arrival to its handler, from its end to the interrupted code, and from one handler
/// to the next.
const ENTRY: u64 = 12;
const EXIT: u64 = 10;
const TAIL: u64 = 6;

impl Cpu {
    /// Raises a usage fault.
    pub(super) fn usage_fault(&mut self, pc: u32, status: u32) {
        self.fault(pc, exception::USAGE_FAULT, status, None);
    }

    /// Raises a fault: exception number `fault`, bits `status` of CFSR, the frame's return address `pc`, and the address
    /// that was accessed, if known. BFAR takes it only with `BFARVALID`.
    pub(super) fn fault(&mut self, pc: u32, fault: u16, status: u32, address: Option<u32>) {
        let running = self.execution_priority();
        let number = {
            let mut machine = self.machine.borrow_mut();
            machine.note_fault(pc, fault, status, address);
            machine.scb.cfsr |= status;
            if let Some(address) = address
                && status & cfsr::BFARVALID != 0
            {
                machine.scb.bfar = address;
            }
            let takes = machine.nvic.is_enabled(fault) && machine.nvic.priority_of(fault) < running;
            if takes {
                fault
            } else if running > -1 {
                machine.scb.hfsr |= FORCED;
                exception::HARD_FAULT
            } else {
                drop(machine);
                self.state = CoreState::LockedUp { pc };
                return;
            }
        };
        self.enter(number, pc);
    }

    /// Takes an exception: pushes a frame and goes to the handler.
    pub(super) fn enter(&mut self, number: u16, return_address: u32) {
        let xpsr = self.get(RegisterARM::XPSR);
        let control = self.get(RegisterARM::CONTROL);
        let handler = xpsr & 0x1FF != 0;
        let float = control & 4 != 0;
        let process = !handler && control & 2 != 0;
        let stack = self.get(RegisterARM::SP);
        let aligned = self.machine.borrow().scb.ccr & 0x200 != 0;
        let padded = aligned && stack & 4 != 0;
        let size: u32 = if float { 0x68 } else { 0x20 };
        let frame = stack.wrapping_sub(size) & if aligned { !7 } else { !3 };

        let mut words = [0_u32; 26];
        for (word, register) in words.iter_mut().zip(STACKED) {
            *word = self.get(register);
        }
        words[6] = return_address & !1;
        words[7] = xpsr & !0x200 | u32::from(padded) << 9;
        if float {
            for (pair, register) in FLOATS.into_iter().enumerate() {
                let value = self.engine.reg_read(register).unwrap_or(0);
                words[8 + 2 * pair] = value as u32;
                words[9 + 2 * pair] = (value >> 32) as u32;
            }
            words[24] = self.get(RegisterARM::FPSCR);
        }
        let bytes: Vec<u8> =
            words.iter().take(size as usize / 4).flat_map(|word| word.to_le_bytes()).collect();
        let stacked = is_writable(frame) && self.engine.write(frame, &bytes);

        self.set(RegisterARM::SP, frame);
        // CONTROL before the exception's number: a handler cannot change its stack.
        self.set(RegisterARM::CONTROL, control & 1);
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & 0xF80F_0000 | 0x0100_0000);
        self.set(RegisterARM::IPSR, u32::from(number));
        let mut link = 0xFFFF_FFE1_u32;
        link |= if float { 0 } else { 0x10 };
        link |= if handler { 0 } else { 0x8 };
        link |= if process { 0x4 } else { 0 };
        self.set(RegisterARM::LR, link);

        let mut machine = self.machine.borrow_mut();
        machine.spend(if core::mem::take(&mut self.returned) { TAIL } else { ENTRY });
        machine.nvic.begin(number);
        machine.count_exception(number);
        let table = match machine.scb.vtor {
            0 => FLASH.start,
            vtor => vtor,
        };
        let vector = self.engine.word(table + 4 * u32::from(number));
        // A failed write of the frame raises a fault of its own; the two exceptions that cannot be interrupted
        // begin nevertheless, and after an NMI the fault is pending.
        let unbroken = matches!(number, exception::NMI | exception::HARD_FAULT);
        if !stacked && number == exception::NMI {
            machine.scb.hfsr |= FORCED;
            machine.nvic.pend(exception::HARD_FAULT);
        }
        let failed = !stacked && !unbroken;
        if !stacked {
            machine.scb.cfsr |= cfsr::STKERR;
            machine.note_fault(return_address, exception::BUS_FAULT, cfsr::STKERR, Some(frame));
        }
        drop(machine);
        match vector {
            Some(vector) if vector & 1 == 1 => self.set(RegisterARM::PC, vector),
            _ => {
                self.machine.borrow_mut().scb.hfsr |= VECTTBL;
                self.state = CoreState::LockedUp { pc: return_address };
            }
        }
        self.fresh_flags();
        if failed {
            // The derived fault replaces the first instruction of the exception.
            let mut machine = self.machine.borrow_mut();
            machine.nvic.end(number);
            if number < exception::INTERRUPT || machine.nvic.priority_of(number) >= 0 {
                machine.nvic.pend(number);
            }
            machine.scb.hfsr |= FORCED;
            machine.nvic.begin(exception::HARD_FAULT);
            machine.count_exception(exception::HARD_FAULT);
            drop(machine);
            let hard_fault = u32::from(exception::HARD_FAULT);
            let vector = self.engine.word(table + 4 * hard_fault);
            self.set(RegisterARM::IPSR, hard_fault);
            self.set(RegisterARM::PC, vector.unwrap_or(1));
            self.fresh_flags();
        }
    }

    /// Refreshes the flags that the engine has cached.
    fn fresh_flags(&mut self) {
        let flags = self.get(RegisterARM::XPSR) & 0xF000_0000;
        self.set(RegisterARM::APSR_NZCV, flags);
    }

    /// Returns from an exception, with return code `code`.
    pub(super) fn leave(&mut self, code: u32) {
        let number = (self.get(RegisterARM::XPSR) & 0x1FF) as u16;
        let ended = self.machine.borrow_mut().nvic.end(number);
        let (thread, process, float) = (code & 8 != 0, code & 4 != 0, code & 0x10 == 0);
        if number == 0 || !ended {
            return self.usage_fault(code, cfsr::INVPC);
        }
        if number != exception::NMI {
            self.set(RegisterARM::FAULTMASK, 0);
        }
        let process = process && thread;
        let stack_pointer = if process { RegisterARM::PSP } else { RegisterARM::SP };
        let stack = self.get(stack_pointer);
        let size: u32 = if float { 0x68 } else { 0x20 };
        let mut bytes = [0; 0x68];
        let read = self.engine.read(stack, bytes.get_mut(..size as usize).unwrap_or(&mut []));
        if !read {
            return self.fault(code, exception::BUS_FAULT, cfsr::UNSTKERR, Some(stack));
        }
        let word =
            |index: usize| u32::from_le_bytes(core::array::from_fn(|i| bytes[4 * index + i]));
        let xpsr = word(7);
        if thread != (xpsr & 0x1FF == 0) {
            return self.usage_fault(code, cfsr::INVPC);
        }
        for (index, register) in STACKED.into_iter().enumerate() {
            self.set(register, word(index));
        }
        if float {
            for (pair, register) in FLOATS.into_iter().enumerate() {
                let value = u64::from(word(8 + 2 * pair)) | u64::from(word(9 + 2 * pair)) << 32;
                let _ = self.engine.reg_write(register, value);
            }
            self.set(RegisterARM::FPSCR, word(24));
        }
        let unwound = stack.wrapping_add(size).wrapping_add(if xpsr & 0x200 == 0 { 0 } else { 4 });
        self.set(stack_pointer, unwound);
        let control = self.get(RegisterARM::CONTROL) & 1;
        // CONTROL after the exception's number: now the stack can change.
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & !0x200);
        let control = control | if process { 2 } else { 0 } | if float { 4 } else { 0 };
        self.set(RegisterARM::CONTROL, control);
        self.set(RegisterARM::PC, word(6) | (xpsr >> 24) & 1);
        let bits = xpsr & 0x0600_FC00;
        self.fresh_flags();
        // Restores the IT state, which writing the PC and the flags may have changed.
        self.set(RegisterARM::EPSR, bits | xpsr & 0x0100_0000);
        self.event = true;

        let mut machine = self.machine.borrow_mut();
        // Tail-chaining: the stack is not popped and pushed between two handlers.
        let tail = machine
            .nvic
            .next
            .is_some_and(|(_, priority)| priority < machine.nvic.active_priority().min(THREAD));
        if !tail {
            machine.spend(EXIT);
        }
        self.returned = tail;
        if thread && machine.scb.scr & 2 != 0 {
            self.state = CoreState::WaitingForInterrupt;
        }
    }
}

/// Priority value below which exceptions are taken.
pub(super) fn masked_below(engine: &Unicorn<'_, ()>, machine: &Machine) -> i16 {
    let get = |register| engine.reg_read(register).unwrap_or(0) as u8;
    let mut priority = THREAD;
    let base = get(RegisterARM::BASEPRI);
    if base != 0 {
        priority = i16::from(machine.nvic.group_of(base));
    }
    if get(RegisterARM::PRIMASK) & 1 != 0 {
        priority = 0;
    }
    if get(RegisterARM::FAULTMASK) & 1 != 0 {
        priority = -1;
    }
    priority
}

/// Returns whether the address is valid for a stack.
const fn is_writable(address: u32) -> bool {
    CCM.contains(address) || RAM.contains(address)
}
