//! Cost of a straight run of instructions: their number, and an estimate of their cycles on a Cortex-M4 without
//! wait states (technical reference manual, table 3-1, 7-1).

use crate::emulator::memory::Memory;
use crate::emulator::part::flash::accelerator::Literal;

/// A stretch of code that runs from its first instruction to its last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Block {
    /// Length, bytes.
    pub size: u32,
    /// Number of instructions.
    pub instructions: u32,
    /// Estimated cycles, with the last branch not taken.
    pub cycles: u32,
    /// Whether the block signals an event.
    pub sends_event: bool,
    /// Position of the first floating-point instruction, in instructions and bytes from the start.
    pub float: Option<(u32, u32)>,
    /// Index of the first literal load in the list of all blocks, and the number of these loads.
    pub literals: (u32, u16),
}

/// Additional cycles of a taken branch, to fill the pipeline.
pub const TAKEN: u64 = 2;

const SEV: u16 = 0xBF40;

impl Block {
    /// The block of `size` bytes at an address.
    pub(crate) fn at(memory: &mut dyn Memory, address: u32, size: u32) -> Self {
        let mut code = vec![0; size as usize];
        memory.read(address, &mut code);
        Self::of(&code)
    }

    /// Decodes `code`.
    #[must_use]
    pub fn of(code: &[u8]) -> Self {
        let mut block = Self { size: code.len() as u32, ..Self::default() };
        let mut after_load = false;
        for (at, first, second) in instructions(code) {
            let cost = if is_wide(first) {
                if block.float.is_none() && is_float(first, second) {
                    block.float = Some((block.instructions, at as u32));
                }
                wide_cost(first, second)
            } else {
                block.sends_event |= first == SEV;
                narrow_cost(first)
            };
            block.cycles += match cost {
                // A load right after a load or store goes down the same pipeline.
                Cost::Load if after_load => 1,
                Cost::Load => 2,
                Cost::Store => 1,
                Cost::Cycles(cycles) => cycles,
            };
            after_load = matches!(cost, Cost::Load | Cost::Store);
            block.instructions += 1;
        }
        block
    }
}

/// Offset of each instruction, its first half-word, and the one after it.
fn instructions(code: &[u8]) -> impl Iterator<Item = (usize, u16, u16)> {
    let half = |at: usize| match code.get(at..at + 2) {
        Some([low, high]) => u16::from_le_bytes([*low, *high]),
        _ => 0,
    };
    let mut next = 0;
    core::iter::from_fn(move || {
        let (at, first) = (next, half(next));
        next += if is_wide(first) { 4 } else { 2 };
        (at < code.len()).then(|| (at, first, half(at + 2)))
    })
}

/// Loads of a block at `address` from places known from the code: literals, and branch tables, which follow their
/// instruction.
#[must_use]
pub fn literals(code: &[u8], address: u32) -> Vec<Literal> {
    let literal = |(at, first, second): (usize, u16, u16)| {
        let offset = at as u32;
        let pc = address + offset + 4;
        let aligned = pc & !3;
        let up_or_down = |distance: u16| match first & 0x0080 {
            0 => aligned.wrapping_sub(u32::from(distance)),
            _ => aligned.wrapping_add(u32::from(distance)),
        };
        let address = match first {
            0x4800..0x5000 => aligned + 4 * u32::from(first & 0xFF),
            // TBB and TBH.
            0xE8DF if second & 0xFFE0 == 0xF000 => pc,
            // LDRD; LDR, LDRH, LDRB; VLDR.
            _ if first & 0xFF7F == 0xE95F => up_or_down(4 * (second & 0xFF)),
            _ if first & 0xFE1F == 0xF81F => up_or_down(second & 0xFFF),
            _ if first & 0xFF3F == 0xED1F => up_or_down(4 * (second & 0xFF)),
            _ => return None,
        };
        Some(Literal { offset, address })
    };
    instructions(code).filter_map(literal).collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cost {
    Load,
    Store,
    Cycles(u32),
}

const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Returns whether the instruction is for coprocessor 10 or 11.
const fn is_float(first: u16, second: u16) -> bool {
    first & 0xEC00 == 0xEC00 && (second >> 9) & 0b111 == 0b101
}

const fn narrow_cost(code: u16) -> Cost {
    match code >> 11 {
        // Register offsets: STR, STRH, STRB below LDRSB, LDR, LDRH, LDRB, LDRSH.
        0b01010 | 0b01011 if (code >> 9) & 7 < 3 => Cost::Store,
        0b01010 | 0b01011 => Cost::Load,
        // LDR literal; LDR, LDRB, LDRH with an offset; LDR from the stack.
        0b01001 | 0b01101 | 0b01111 | 0b10001 | 0b10011 => Cost::Load,
        0b01100 | 0b01110 | 0b10000 | 0b10010 => Cost::Store,
        // STM, LDM.
        0b11000 | 0b11001 => Cost::Cycles(1 + (code & 0xFF).count_ones()),
        // PUSH and POP.
        0b10110 | 0b10111 if code & 0x0600 == 0x0400 => {
            Cost::Cycles(1 + (code & 0x1FF).count_ones())
        }
        _ => Cost::Cycles(1),
    }
}

const fn wide_cost(first: u16, second: u16) -> Cost {
    if is_float(first, second) {
        return float_cost(first, second);
    }
    match first >> 9 {
        // LDM, STM.
        0b111_0100 if first & 0x0040 == 0 => Cost::Cycles(1 + second.count_ones()),
        // Exclusives and table branches.
        0b111_0100 if first & 0x0120 == 0 => Cost::Cycles(2),
        // LDRD, STRD.
        0b111_0100 => Cost::Cycles(3),
        0b111_1100 if first & 0x0010 == 0 => Cost::Store,
        0b111_1100 => Cost::Load,
        // Multiplications and divisions.
        0b111_1101 if first & 0xFFD0 == 0xFB90 && second & 0x00F0 == 0x00F0 => Cost::Cycles(7),
        0b111_1101 if first & 0xFF80 == 0xFB00 && second & 0xF000 != 0xF000 => Cost::Cycles(2),
        _ => Cost::Cycles(1),
    }
}

const fn float_cost(first: u16, second: u16) -> Cost {
    if first & 0xEE00 == 0xEC00 {
        // VLDR and VSTR are P = 1 and W = 0; a transfer of two core registers is 1100 010x.
        if first & 0x0120 == 0x0100 {
            let double = second & 0x0100 != 0;
            return match (first & 0x0010 == 0, double) {
                (true, false) => Cost::Store,
                (false, false) => Cost::Load,
                (_, true) => Cost::Cycles(3),
            };
        }
        if first & 0x01E0 == 0x0040 {
            return Cost::Cycles(2);
        }
        return Cost::Cycles(1 + (second & 0xFF) as u32);
    }
    // A transfer to or from a core register.
    if second & 0x0010 != 0 {
        return Cost::Cycles(1);
    }
    let op = ((first >> 4) & 0b1000) | ((first >> 4) & 0b0011);
    match op {
        // VMLA, VMLS, VNMLA, VNMLS, VFNMA, VFMA.
        0b0000 | 0b0001 | 0b1001 | 0b1010 => Cost::Cycles(3),
        0b1000 => Cost::Cycles(14),
        // VSQRT.
        0b1011 if first & 0xF == 1 && second & 0x00C0 == 0x00C0 => Cost::Cycles(14),
        _ => Cost::Cycles(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(halves: &[u16]) -> Block {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        Block::of(&code)
    }

    #[test]
    fn loads_in_a_row_share_the_pipeline() {
        // ldr r0, [r1]; ldr r2, [r1, #4]; adds r0, r0, r2
        let block = block(&[0x6808, 0x684A, 0x1880]);
        assert_eq!((block.instructions, block.cycles), (3, 2 + 1 + 1));
    }

    #[test]
    fn divisions_and_square_roots_are_long_and_fused_sums_are_three() {
        // vdiv.f32 s0, s0, s1; vsqrt.f32 s0, s0; vfma.f32 s0, s1, s2; vadd.f32 s0, s0, s1
        let block = block(&[0xEE80, 0x0A20, 0xEEB1, 0x0AC0, 0xEEA0, 0x0A81, 0xEE30, 0x0A20]);
        assert_eq!((block.instructions, block.cycles), (4, 14 + 14 + 3 + 1));
        assert_eq!(block.float, Some((0, 0)));
    }

    #[test]
    fn a_literal_load_reports_its_address() {
        // nop; ldr r0, [pc, #4]; ldr.w r1, [pc, #-4]; vldr s0, [pc, #8]; tbb [pc, r0]
        let halves: [u16; 8] = [0xBF00, 0x4801, 0xF85F, 0x1004, 0xED9F, 0x0A02, 0xE8DF, 0xF000];
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let read: Vec<(u32, u32)> = literals(&code, 0x0801_0000)
            .into_iter()
            .map(|literal| (literal.offset, literal.address - 0x0801_0000))
            .collect();
        assert_eq!(read, [(2, 8), (4, 4), (8, 20), (12, 16)]);
    }

    #[test]
    fn sev_is_detected_and_pushes_count_registers() {
        // push {r4, r5, lr}; sev; pop {r4, r5, pc}
        let block = block(&[0xB530, 0xBF40, 0xBD30]);
        assert!(block.sends_event);
        assert_eq!((block.instructions, block.cycles), (3, 4 + 1 + 4));
    }
}
