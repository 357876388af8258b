//! Diagnosis of a board and its sensor: object 0x2117, and the lines that show it to people.
//!
//! The board sends numbers only. Its text is made by the program that shows it: by `footfall foot … report`, and by the
//! program that measures a new board.

use core::fmt;

/// Numbers of a board and its sensor that tell whether the hardware works.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Diagnosis {
    /// Cause of the processor's start.
    pub reset: Reset,
    /// Clock of the processor, kHz.
    pub clock_khz: u32,
    /// Whether the crystal drives it.
    pub is_crystal_used: bool,
    /// Measured frequency of the crystal, kHz; 0 if it was not measured or does not start.
    pub crystal_khz: u16,
    /// Option bytes in effect, of an STM32F405: `nWRP` in the high half, `RDP` and `USER` in the low one; 0 on a chip without
    /// them.
    pub option_bytes: u32,
    /// Identifier of the chip or its flash, unique to the board; 0 beyond its length.
    pub identifier: [u32; 4],
    /// Clocks of the sensor's bus, slowest first, kHz.
    pub bus_khz: [u16; 3],
    /// Clock in use: index in `bus_khz`.
    pub bus_clock: u8,
    /// Failed transfers and wrong readings at each clock since the start.
    pub bus_errors: [u16; 3],
    /// `WHO_AM_I` as last read, 0x6C if right; 0 before the first reading.
    pub identity: u8,
    /// Data-ready edges in the last 1000 ticks; 0 if the board does not count them.
    pub edges: u16,
    /// Variance of each axis in the quietest 1000 ticks, 1/2000 code², in the order ax ay az wx wy wz; 0 before them. This is the
    /// sum of the squared differences of successive codes.
    pub noise: [u32; 6],
    /// Mean of each axis in these ticks, codes.
    pub mean: [i16; 6],
}

/// Cause of the processor's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reset {
    /// The chip does not tell.
    #[default]
    Unknown = 0,
    /// Power-up, or a dip of the supply.
    Power = 1,
    /// The reset pin.
    Pin = 2,
    /// The program: a crash, a command, or an update.
    Program = 3,
    /// The watchdog.
    Watchdog = 4,
}

impl Reset {
    const ALL: [Self; 5] = [Self::Unknown, Self::Power, Self::Pin, Self::Program, Self::Watchdog];

    const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Power => "power-up, or a dip of the supply",
            Self::Pin => "reset pin",
            Self::Program => "by the program: a crash, a command, or an update",
            Self::Watchdog => "watchdog",
        }
    }
}

impl Diagnosis {
    /// The highest sub-index of the object.
    pub const HIGHEST_SUBINDEX: u8 = 30;

    /// Value behind a sub-index, as its bits; `None` if there is no such sub-index.
    #[must_use]
    pub fn raw(&self, subindex: u8) -> Option<u32> {
        let part = |first: u8| usize::from(subindex - first);
        Some(match subindex {
            1 => self.reset as u32,
            2 => self.clock_khz,
            3 => u32::from(self.is_crystal_used),
            4 => u32::from(self.crystal_khz),
            5 => self.option_bytes,
            6..=9 => *self.identifier.get(part(6))?,
            10..=12 => u32::from(*self.bus_khz.get(part(10))?),
            13 => u32::from(self.bus_clock),
            14..=16 => u32::from(*self.bus_errors.get(part(14))?),
            17 => u32::from(self.identity),
            18 => u32::from(self.edges),
            19..=24 => *self.noise.get(part(19))?,
            25..=30 => u32::from(self.mean.get(part(25))?.cast_unsigned()),
            _ => return None,
        })
    }

    /// Sets the value behind a sub-index from its bits. Ignores a sub-index that does not exist.
    pub fn set_raw(&mut self, subindex: u8, raw: u32) {
        let part = |first: u8| usize::from(subindex - first);
        let low = raw as u16;
        match subindex {
            1 => self.reset = Reset::ALL.get(raw as usize).copied().unwrap_or_default(),
            2 => self.clock_khz = raw,
            3 => self.is_crystal_used = raw != 0,
            4 => self.crystal_khz = low,
            5 => self.option_bytes = raw,
            6..=9 => set(&mut self.identifier, part(6), raw),
            10..=12 => set(&mut self.bus_khz, part(10), low),
            13 => self.bus_clock = raw as u8,
            14..=16 => set(&mut self.bus_errors, part(14), low),
            17 => self.identity = raw as u8,
            18 => self.edges = low,
            19..=24 => set(&mut self.noise, part(19), raw),
            25..=30 => set(&mut self.mean, part(25), low.cast_signed()),
            _ => {}
        }
    }
}

fn set<T>(values: &mut [T], at: usize, value: T) {
    if let Some(place) = values.get_mut(at) {
        *place = value;
    }
}

/// Name and value of each line, without an end of the last one.
impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { identifier, identity, edges, .. } = self;
        writeln!(f, "reset    {}", self.reset.name())?;
        write!(f, "clock    {} kHz, ", self.clock_khz)?;
        match (self.is_crystal_used, self.crystal_khz) {
            (true, 0) => writeln!(f, "from the crystal, which is not measured")?,
            (true, khz) => writeln!(f, "from the crystal, measured as {khz} kHz")?,
            (false, 0) => writeln!(f, "without a crystal")?,
            (false, khz) => writeln!(f, "not from the crystal, measured as {khz} kHz")?,
        }
        match self.option_bytes {
            0 => writeln!(f, "options  none")?,
            bytes => writeln!(f, "options  0x{bytes:08X}")?,
        }
        write!(f, "chip    ")?;
        for word in identifier {
            write!(f, " {word:08X}")?;
        }
        write!(f, "\nsensor   WHO_AM_I 0x{identity:02X}, ")?;
        match edges {
            0 => writeln!(f, "no data-ready edge, or not counted")?,
            _ => writeln!(f, "{edges} data-ready edges in 1000 ticks")?,
        }
        write!(f, "bus     ")?;
        for (number, (khz, errors)) in self.bus_khz.iter().zip(self.bus_errors).enumerate() {
            let comma = if number == 0 { "" } else { "," };
            let in_use = if number == usize::from(self.bus_clock) { " (in use)" } else { "" };
            write!(f, "{comma} {khz} kHz{in_use} {errors} errors")?;
        }
        write!(f, "\nnoise   ")?;
        for (axis, noise) in AXES.iter().zip(self.noise) {
            // In hundredths of a code.
            let noise = (5 * u64::from(noise)).isqrt();
            write!(f, " {axis} {}.{:02}", noise / 100, noise % 100)?;
        }
        write!(f, " codes, in the quietest 1000 ticks\nmean    ")?;
        for (axis, mean) in AXES.iter().zip(self.mean) {
            write!(f, " {axis} {mean}")?;
        }
        write!(f, " codes, in the same ticks")
    }
}

/// Axes in the order of the codes.
const AXES: [&str; 6] = ["ax", "ay", "az", "wx", "wy", "wz"];

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const DIAGNOSIS: Diagnosis = Diagnosis {
        reset: Reset::Power,
        clock_khz: 160_000,
        is_crystal_used: true,
        crystal_khz: 8_012,
        option_bytes: 0x0FFC_AAE1,
        identifier: [0x0033_0047, 0x3233_5107, 0x3033_3433, 0],
        bus_khz: [1_250, 2_500, 5_000],
        bus_clock: 2,
        bus_errors: [0, 1, 65_535],
        identity: 0x6C,
        edges: 6_667,
        noise: [33_620, 33_785, 33_949, 953, 980, u32::MAX],
        mean: [-2_049, 2, 3, 4, 5, -6],
    };

    #[test]
    fn each_value_returns_from_its_sub_index() {
        let mut copy = Diagnosis::default();
        for subindex in 0..=Diagnosis::HIGHEST_SUBINDEX + 1 {
            copy.set_raw(subindex, DIAGNOSIS.raw(subindex).unwrap_or(9));
        }
        assert_eq!(copy, DIAGNOSIS);
        assert_eq!((DIAGNOSIS.raw(0), DIAGNOSIS.raw(31)), (None, None));
        copy.set_raw(1, 77);
        assert_eq!(copy.reset, Reset::Unknown);
    }

    #[test]
    fn lines_show_each_value() {
        assert_eq!(
            DIAGNOSIS.to_string(),
            "reset    power-up, or a dip of the supply
clock    160000 kHz, from the crystal, measured as 8012 kHz
options  0x0FFCAAE1
chip     00330047 32335107 30333433 00000000
sensor   WHO_AM_I 0x6C, 6667 data-ready edges in 1000 ticks
bus      1250 kHz 0 errors, 2500 kHz 1 errors, 5000 kHz (in use) 65535 errors
noise    ax 4.10 ay 4.11 az 4.12 wx 0.69 wy 0.70 wz 1465.42 codes, in the quietest 1000 ticks
mean     ax -2049 ay 2 az 3 wx 4 wy 5 wz -6 codes, in the same ticks"
        );
    }

    #[test]
    fn crystal_that_is_not_used_or_not_measured_is_named() {
        for (is_crystal_used, crystal_khz, part) in [
            (true, 0, "from the crystal, which is not measured"),
            (false, 0, "without a crystal"),
            (false, 12_000, "not from the crystal, measured as 12000 kHz"),
        ] {
            let diagnosis = Diagnosis { is_crystal_used, crystal_khz, ..DIAGNOSIS };
            assert!(diagnosis.to_string().contains(part), "{diagnosis}");
        }
    }
}
