//! Notes between the program and the bootloader, which a reset leaves and a power cut erases.

/// Address of the note, two words: the last of CCM RAM, behind what `memory.x` gives to the linker.
pub const ADDRESS: usize = 0x1000_FFF8;

/// Note of the program, that it is not to be started: another one is to be received.
pub const STAY: [u32; 2] = [0xF007_57A9, !0xF007_57A9];

/// Note of the bootloader, that no master has asked for this start: the program goes on as after power-up.
pub const RESUME: [u32; 2] = [0xF007_4E50, !0xF007_4E50];
