//! Remedies: for faults, flags and refusals ([`Trouble`]), and for errors and notices of this library ([`FootHint`]).
//!
//! The remedies of a [`Trouble`] are the same in every program: one table for explanations, monitors and the
//! documentation. The remedy of an error may depend on the program: the command line names an option or another
//! command, Python an argument. Such an error has a [`FootHint`], which each program expresses in its own words.

use estimator_core::Flag;
use wire::{AbortCode, Fault};

/// A condition reported by a foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// Fault of the board.
    Fault(Fault),
    /// Flag of an estimate.
    Flag(Flag),
    /// Refusal of a request.
    Refusal(AbortCode),
}

impl Trouble {
    /// Iterates over all faults, flags and refusals.
    pub fn all() -> impl Iterator<Item = Self> {
        let faults = Fault::ALL.into_iter().map(Self::Fault);
        let flags = Flag::ALL.into_iter().map(Self::Flag);
        let refusals = AbortCode::ALL.into_iter().map(Self::Refusal);
        faults.chain(flags).chain(refusals)
    }

    /// Finds a condition by name, with `_`, `-` or spaces between the words, or by code, such as 0x7007.
    #[must_use]
    pub fn find(text: &str) -> Option<Self> {
        let text = words(text);
        let wanted = code(&text);
        let is_coded = |trouble: &Self| wanted.is_some() && trouble.code() == wanted;
        Self::all().find(|trouble| words(trouble.name()) == text || is_coded(trouble))
    }

    /// Name of the condition.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fault(fault) => fault.name(),
            Self::Flag(flag) => flag.name(),
            Self::Refusal(refusal) => refusal.name(),
        }
    }

    /// Code; `None` for a flag.
    #[must_use]
    pub fn code(self) -> Option<u32> {
        match self {
            Self::Fault(fault) => Some(u32::from(fault.code())),
            Self::Flag(_) => None,
            Self::Refusal(refusal) => Some(refusal.code()),
        }
    }

    /// Code as text; empty for a flag.
    #[must_use]
    pub fn code_text(self) -> String {
        match self {
            Self::Fault(fault) => format!("0x{:04X}", fault.code()),
            Self::Flag(_) => String::new(),
            Self::Refusal(refusal) => format!("0x{:08X}", refusal.code()),
        }
    }

    /// Kind in one word.
    #[must_use]
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Fault(_) => "fault",
            Self::Flag(_) => "flag",
            Self::Refusal(_) => "refusal",
        }
    }

    /// Effect on the probability; empty for a refusal.
    #[must_use]
    pub const fn consequence(self) -> &'static str {
        match self {
            Self::Fault(fault) if fault.voids_estimate() => {
                "every probability is 0, and no frame says \"stable\", until it is cleared"
            }
            Self::Fault(_) => "the estimate goes on",
            Self::Flag(Flag::Settling) => "the estimate continues, with limits that suit most feet",
            Self::Flag(Flag::TimeGap) => {
                "a gap of up to half a window, 13 ms, leaves the probability unchanged; after a longer gap the probability starts near 0"
            }
            Self::Flag(Flag::WindowNotFull) => {
                "the estimate uses the samples so far, which do not fill the window yet"
            }
            Self::Flag(Flag::Unproven) => {
                "the probability stays at or below 0.5, and no frame says \"stable\""
            }
            Self::Flag(_) => "the sample counts as motion",
            Self::Refusal(_) => "",
        }
    }

    /// Remedy, most likely cause first.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::Fault(fault) => of_fault(fault),
            Self::Flag(flag) => of_flag(flag),
            Self::Refusal(refusal) => of_refusal(refusal),
        }
    }
}

/// Normalises a name to lower case with one space between words.
fn words(text: &str) -> String {
    let parts = text.split([' ', '_', '-']).filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join(" ").to_lowercase()
}

fn code(text: &str) -> Option<u32> {
    u32::from_str_radix(text.strip_prefix("0x")?, 16).ok()
}

/// Defines the remedies for the variants of an enum.
macro_rules! remedies {
    ($(fn $name:ident($enum:ident) { $($($variant:ident)|+: $remedy:literal;)+ })+) => {
        $(const fn $name(of: $enum) -> &'static str {
            match of {
                $($($enum::$variant)|+ => $remedy),+
            }
        })+
    };
}

remedies! {
    fn of_fault(Fault) {
        SensorSilent: "check the supply and the wires of the sensor: there is no data-ready edge, or no new reading; if the fault clears without action, look for a loose contact";
        SensorFrozen: "if the sensor is on wires, check those of MISO and chip select; if it is on the board, or if single axes repeat, it is damaged: replace it";
        SensorWrongId: "switch power off and on; then check the sensor's supply, the wires of its bus, and that the part is an LSM6DSOX; the detail is the value read: 0x00 or 0xFF means no supply or an open wire";
        SensorReset: "the sensor's supply dipped: check its decoupling and the wire; the board configures the sensor again";
        SensorConfigMismatch: "check the wires of the sensor's bus for length and crosstalk; after three failures the board slows the bus down";
        SensorSaturated: "the foot is beyond ±16 g or ±2000 °/s for more than an impact: check for a loose mounting; a stuck reading at its limit is a damaged sensor";
        SensorTiming: "edges come too often or too seldom: check INT1 for crosstalk, and the sensor for its data rate after a dip of the supply";
        SensorSelfTest: "keep the foot still and start it again; if the fault remains, the sensor is damaged";
        LoadSensorOpen: "check the load sensor's plug and its supply; without one, set the source of the load (0x2015:1) to none";
        CrystalMissing: "the crystal does not start, or its frequency is not the one that the program is built for; the detail of the emergency and the log give it in kHz. CAN is off, UART works: check the crystal and its solder joints";
        ConfigCorrupted: "the foot runs with the defaults, and the stored settings are kept until the next store: the detail shows whether they are damaged (0), are incompatible (1), were not read after three watchdog resets (2), or hold learnt values of another version (3: the foot learns again); check all settings and store them again; if it comes back, the flash is worn";
        ConfigStore: "detail 1: raise the supply above 3.0 V; detail 0: the flash does not read back: replace the board";
        Panic | HardFault: "note the program counter (0x2113:2), the version and the program's number, and report them; docs/reference/faults.md describes how to find the line of that address; the board has restarted";
        WatchdogReset: "the program hung and was restarted; if it happens often, check the supply and report it";
        LateTick: "send fewer frames (events of the PDOs, UART streams) or requests; while settings are stored in pre-operational state it is expected";
        CanOverrun: "frames arrive faster than the foot can take them: send it fewer at once";
        CanErrorPassive: "check the bus: 120 Ω at both ends, the same bit rate everywhere, another node that acknowledges";
        CanBusOff: "check the bus for a short circuit, swapped wires or another bit rate; the foot keeps trying to recover";
        PdoLength: "send four bytes as RPDO1: the load as REAL32";
        UartOverrun: "send requests more slowly, and check the line's rate";
        PdoTimeout: "the robot has stopped sending the load: check its program, or set the source of the load (0x2015:1) to none";
        GyroBias: "the foot turned while it seemed to rest, its bias moved by more than 6 °/s in a walk, or the gyroscope is beyond its data sheet: hold the foot still and reset it; if the fault remains, replace the sensor";
        Misread: "check the wires of the sensor's bus for length and crosstalk: each sample is read only once, so some may be wrong";
        DataReadyDead: "check the wire of INT1: the sensor measures, but some or all data-ready edges are missing; samples are read by the timer, with times that may be 75 µs off. Cleared once edges have come for a second";
        SensorScale: "about half of 9.8 m/s² at rest: the part is an LSM6DSO32, set 0x2017:7 to 1; otherwise check bias and scale of the accelerometer (0x2017)";
    }
    fn of_flag(Flag) {
        WindowNotFull: "none is needed: the flag ends after one window";
        AttitudeNotInitialised: "hold the foot still for a fifth of a second";
        Saturated: "a few samples at landings are expected; if there are more, check the mounting or choose a wider range";
        Stale: "samples repeat: check the rate of the recording, and the sensor's wiring on a board";
        InvalidSample: "check units and times of the recording; on a board the sensor could not be read";
        TimeGap: "samples are missing: check the logger for drops";
        Settling: "walk four or five steps, or calibrate the foot: it then starts with learnt values (object 0x2018)";
        Unproven: "let the foot rest for half a second, or take a step";
    }
    fn of_refusal(AbortCode) {
        ToggleBit | Command | SequenceNumber | Crc: "two masters address this foot, or one was restarted during a transfer: repeat the request";
        WriteOnly | ReadOnly: "see the access of the object in wire/footfall.eds";
        NoObject | NoSubindex: "check index and sub-index; a foot of an older version lacks newer objects";
        Incompatible: "set the other value first: an upper threshold must stay above its lower one";
        Hardware: "see the fault: the flash or the supply";
        Length | TooLong | TooShort: "send as many bytes as the object's type has";
        InvalidValue | TooHigh | TooLow: "see the object's range in wire/footfall.eds";
        CannotStore: "write the signature: \"save\" to 0x1010, \"load\" to 0x1011";
        Locked: "the configuration is locked: unlock it first (0x2005)";
        TooSoon: "wait a second, and store again";
        DeviceState: "put the foot into pre-operational state first: it does not stream in that state";
    }
}

/// Remedy for an error or a notice that depends on the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootHint {
    /// Name one of the feet on the line.
    NameOneFoot,
    /// Name this node as a foot, so that its contacts are decoded.
    NameNodeAsFoot(u8),
    /// List the objects of a foot.
    ListObjects,
    /// Switch the self-test at each start off, and store that.
    SwitchSelfTestOff,
    /// Leave out the options of an estimate: they are for recordings of an IMU.
    OmitEstimateOptions,
    /// Mount the drive of the loader, which has this label, and copy the file by hand. Linux alone.
    MountDrive(&'static str),
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_condition_is_found_by_name_and_code() {
        for trouble in Trouble::all() {
            assert_eq!(Trouble::find(trouble.name()), Some(trouble));
            assert_eq!(
                Trouble::find(&trouble.name().replace(' ', "_").to_uppercase()),
                Some(trouble)
            );
            if let Some(code) = trouble.code() {
                assert_eq!(Trouble::find(&format!("0x{code:x}")), Some(trouble));
                assert_eq!(Trouble::find(&trouble.code_text()), Some(trouble));
            }
        }
        for unknown in ["", "0x", "0x7FFF", "7007", "sensor"] {
            assert_eq!(Trouble::find(unknown), None, "{unknown:?}");
        }
    }

    #[test]
    fn names_are_unique() {
        let names: Vec<_> = Trouble::all().map(|trouble| words(trouble.name())).collect();
        let distinct: BTreeSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
    }
}
