//! Instructions of ARMv8-M (DDI0553) that the emulator lacks: loads and stores with acquire and release, and transfers
//! of pairs of floating-point registers. It decodes VSEL, VMAXNM and VMINNM by other bits than the manual.

use rp2350_emu::CortexM33;
use rp2350_emu::core::CoreBus;

/// The local monitor of exclusive accesses. Exclusive accesses without acquire and release go through it, too, because a
/// program mixes both. One core runs, so that the order of accesses does not matter.
#[derive(Default)]
pub struct Monitor {
    address: Option<u32>,
    exception: u32,
}

impl Monitor {
    /// Executes the instruction at the core's program counter, if this module has it; returns whether it does.
    pub fn execute<B: CoreBus>(&mut self, core: &mut CortexM33, bus: &mut B) -> bool {
        let exception = core.regs.xpsr & 0x1FF;
        if exception != self.exception {
            // Each exception, and each return from one, opens the monitor.
            self.exception = exception;
            self.address = None;
        }
        let pc = core.regs.pc();
        let first = bus.read16(pc, 0);
        if !matches!(first & 0xFFF0, 0xE840 | 0xE850 | 0xE8C0 | 0xE8D0) {
            return false;
        }
        let second = bus.read16(pc + 2, 0);
        let is_load = first & 0x10 != 0;
        let mut address = core.regs.r[usize::from(first & 0xF)];
        // The register for the success of a store is in bits 8 to 11 if a word is stored, else in bits 0 to 3.
        let (is_exclusive, size, result) = match (first & 0x80, (second >> 4) & 0xFF) {
            (0, _) => {
                address += 4 * u32::from(second & 0xFF);
                (true, 4, second >> 8)
            }
            (_, 0xF4 | 0xFC) => (true, 1, second),
            (_, 0xF5 | 0xFD) => (true, 2, second),
            (_, 0xFE) => (true, 4, second),
            (_, 0xF8) => (false, 1, second),
            (_, 0xF9) => (false, 2, second),
            (_, 0xFA) => (false, 4, second),
            _ => return false,
        };
        let register = usize::from(second >> 12);
        if is_load {
            core.regs.r[register] = match size {
                1 => bus.read8(address, 0).into(),
                2 => bus.read16(address, 0).into(),
                _ => bus.read32(address, 0),
            };
            if is_exclusive {
                self.address = Some(address);
            }
        } else {
            let stores = !is_exclusive || self.address.take() == Some(address);
            let value = core.regs.r[register];
            match size {
                _ if !stores => {}
                1 => bus.write8(address, value as u8, 0),
                2 => bus.write16(address, value as u16, 0),
                _ => bus.write32(address, value, 0),
            }
            if is_exclusive {
                core.regs.r[usize::from(result & 0xF)] = u32::from(!stores);
            }
        }
        core.regs.set_pc(pc + 4);
        true
    }
}

/// Returns the halfwords of one or two instructions with which the emulator has the effect of this instruction.
/// `None` if the emulator executes this instruction itself.
pub fn as_known(first: u16, second: u16) -> Option<([u16; 2], Option<[u16; 2]>)> {
    match (first & 0xFE00, second & 0x0F00) {
        (0xEC00, 0x0B00) => Some(as_singles(first, second)),
        // C2.4.403: D is bit 6, and the condition bits 5 and 4. The emulator takes them from bit 4, and bits 6 and 5.
        (0xFE00, 0x0A00) => {
            let (register, condition) = (first >> 6 & 1, first >> 4 & 3);
            Some(([first & !0x70 | condition << 5 | register << 4, second], None))
        }
        _ => None,
    }
}

/// Transfer of pairs of registers as transfers of single ones. A register D(n) is the pair of S(2n) and S(2n + 1).
fn as_singles(first: u16, second: u16) -> ([u16; 2], Option<[u16; 2]>) {
    // The form with single registers: as many words, from the same register on.
    let second = second & !0x0100;
    if first & 0x0120 != 0x0100 {
        return ([first, second], None);
    }
    // VLDR and VSTR take one register: the next one is a word further.
    let words =
        if first & 0x80 == 0 { -i32::from(second & 0xFF) } else { i32::from(second & 0xFF) } + 1;
    let sign = if words < 0 { 0 } else { 0x80 };
    let next = [first & !0x80 | sign | 0x40, second & !0xFF | words.unsigned_abs() as u16];
    ([first, second], Some(next))
}

/// Number of the interrupt that a store to the NVIC's STIR makes pending, if the instruction at the program counter is one.
/// The emulator has no STIR.
pub fn software_interrupt<B: CoreBus>(core: &CortexM33, bus: &mut B) -> Option<u32> {
    const STIR: u32 = 0xE000_EF00;
    let pc = core.regs.pc();
    let first = bus.read16(pc, 0);
    let (base, offset, register) = if first & 0xF800 == 0x6000 {
        (first >> 3 & 7, u32::from(first >> 6 & 31) * 4, first & 7)
    } else if first & 0xFFF0 == 0xF8C0 {
        let second = bus.read16(pc + 2, 0);
        (first & 0xF, u32::from(second & 0xFFF), second >> 12)
    } else {
        return None;
    };
    let address = core.regs.r[usize::from(base)].wrapping_add(offset);
    (address == STIR).then(|| core.regs.r[usize::from(register)] & 0x1FF)
}
