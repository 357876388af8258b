//! Computations of the test programs, for target and host alike.

#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

/// A point on an endless path; every step depends on every bit of the previous one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    x: f32,
    y: f32,
    z: f32,
    steps: u32,
}

impl Orbit {
    /// Start of path number `seed`.
    #[must_use]
    pub const fn new(seed: u32) -> Self {
        Self { x: 0.1 + seed as f32 * 0.01, y: 0.2, z: 0.3, steps: 0 }
    }

    /// `count` steps: sums, products, a division and a comparison each (Hénon's map, folded).
    pub fn advance(&mut self, count: u32) {
        for _ in 0..count {
            let x = 1.0 - 1.4 * self.x * self.x + self.y;
            let y = 0.3 * self.x + 0.01 * self.z;
            let z = (self.z + x) / (1.5 + y * y);
            self.x = if x.abs() > 1.5 { x * 0.25 } else { x };
            self.y = y;
            self.z = z;
            self.steps = self.steps.wrapping_add(1);
        }
    }

    /// Number of steps so far.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// All bits of the position.
    #[must_use]
    pub const fn bits(&self) -> [u32; 3] {
        [self.x.to_bits(), self.y.to_bits(), self.z.to_bits()]
    }
}

/// Addresses through which the fault program and its tests communicate: in CCM RAM, which no start-up
/// code and no stack touches.
pub mod mailbox {
    /// The fault to provoke, a [`Misuse`](super::Misuse).
    pub const MISUSE: u32 = 0x1000_0000;
    /// Number of starts of the program.
    pub const STARTS: u32 = 0x1000_0004;
    /// Program counter that the fault handler found in its frame.
    pub const PC: u32 = 0x1000_0008;
    /// Fault status register in the fault handler.
    pub const CFSR: u32 = 0x1000_000C;
    /// Hard fault status register in the fault handler.
    pub const HFSR: u32 = 0x1000_0010;
    /// Number of the handler.
    pub const HANDLER: u32 = 0x1000_0014;
    /// Reset flags of the last start.
    pub const RESET_FLAGS: u32 = 0x1000_0018;
}

/// Misuse by the fault program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Misuse {
    /// Executes an undefined instruction, at the symbol `undefined_here`.
    Undefined = 1,
    /// Loads from an unmapped address, at `load_here`.
    Load = 2,
    /// Uses the floating-point unit while it is off, at `float_here`, usage faults enabled.
    Float = 4,
    /// Starts the watchdog and never feeds it.
    Watchdog = 6,
    /// Stores to a peripheral without a clock, at `store_here`.
    Unclocked = 10,
    /// Loads from a peripheral that is not modelled, at `load_here`.
    Unmodelled = 11,
    /// Loads through a null pointer, at `load_here`.
    Null = 12,
    /// Raises the core clock without wait states of flash, at `store_here`.
    WaitStates = 13,
}

impl Misuse {
    /// All variants.
    pub const ALL: [Self; 8] = [
        Self::Undefined,
        Self::Load,
        Self::Float,
        Self::Watchdog,
        Self::Unclocked,
        Self::Unmodelled,
        Self::Null,
        Self::WaitStates,
    ];
}
