//! Faults, one row each, and the emergency message (EMCY) that reports them.
//!
//! | bytes | field |
//! |---|---|
//! | 0, 1 | emergency code, [`Fault::code`]; 0x0000 if the fault was cleared |
//! | 2 | present error register (object 0x1001) |
//! | 3 | number of the fault, [`Fault::number`] |
//! | 4 to 7 | detail, explained by [`Fault::detail`] |

use canopen_rs::emcy::{EmergencyMessage, ErrorRegister};

/// Defines the enumeration and the properties of each fault, from one row per fault: its number, emergency code and
/// name, the bit that it sets in the error register, its effect on the estimate, and the meaning of the detail of its
/// emergency message.
///
/// The first digits of a code are its class in CiA 301 (table 26): 5 hardware, 6 software, 7 additional modules, 8
/// monitoring, FF device specific. CiA 301 also defines the meaning of 0x6300, 0x8110, 0x8120, 0x8140 and 0x8210.
macro_rules! faults {
    ($(
        $(#[$doc:meta])*
        $variant:ident = $number:literal, $code:literal, $name:literal, $register:ident, $estimate:ident, $detail:literal;
    )*) => {
        /// A fault of the board.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Fault {
            $($(#[$doc])* $variant = $number,)*
        }

        /// Faults that void the estimate.
        const VOIDING: u32 = $((voids!($estimate) as u32) << $number)|*;

        impl Fault {
            /// All faults, in the order of their numbers.
            pub const ALL: [Self; [$($number),*].len()] = [$(Self::$variant),*];

            /// The emergency code.
            #[must_use]
            pub const fn code(self) -> u16 {
                match self {
                    $(Self::$variant => $code,)*
                }
            }

            /// Short description.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// Meaning of the detail of its emergency message.
            #[must_use]
            pub const fn detail(self) -> &'static str {
                match self {
                    $(Self::$variant => $detail,)*
                }
            }

            /// Bits it sets in the error register, besides the generic one.
            #[must_use]
            pub const fn register_bits(self) -> u8 {
                match self {
                    $(Self::$variant => ErrorRegister::$register,)*
                }
            }

        }
    };
}

macro_rules! voids {
    (void) => {
        true
    };
    (unaffected) => {
        false
    };
}

faults! {
    /// The sensor gives no data-ready edge.
    SensorSilent = 0, 0x7001, "sensor silent", MANUFACTURER, void, "duration, µs";
    /// The sensor repeats its readings, on every axis or on some.
    SensorFrozen = 1, 0x7002, "sensor frozen", MANUFACTURER, void, "bit i: axis i repeats, in the order ax ay az wx wy wz";
    /// The sensor's `WHO_AM_I` does not match the part.
    SensorWrongId = 2, 0x7003, "sensor has a wrong WHO_AM_I", MANUFACTURER, void, "value of WHO_AM_I";
    /// The sensor has lost its configuration: it was reset.
    SensorReset = 3, 0x7004, "sensor was reset", MANUFACTURER, void, "samples affected";
    /// A register did not read back the value that was written.
    SensorConfigMismatch = 4, 0x7005, "sensor register does not read back", MANUFACTURER, void, "register, written, read, from the lowest byte";
    /// The sensor has been at the end of its range for longer than an impact lasts.
    SensorSaturated = 5, 0x7006, "sensor saturated for long", MANUFACTURER, void, "samples affected";
    /// Data-ready edges are not in step with the sampling loop.
    SensorTiming = 6, 0x7007, "sensor out of step", MANUFACTURER, void, "samples affected";
    /// The sensor's self-test failed.
    SensorSelfTest = 7, 0x7008, "sensor self-test failed", MANUFACTURER, void, "bit i: axis i failed, in the order ax ay az wx wy wz";
    /// The load sensor's input is open or out of range.
    LoadSensorOpen = 8, 0x7010, "load sensor open", MANUFACTURER, unaffected, "raw reading";
    /// The crystal does not start, or has another frequency. The board runs on its internal oscillator, with CAN off.
    CrystalMissing = 9, 0x5001, "crystal missing", MANUFACTURER, unaffected, "frequency of the crystal, kHz; 0 if it does not start";
    /// The stored configuration could not be read, or only in part. An older one or defaults are in use.
    ConfigCorrupted = 10, 0x6300, "stored configuration unreadable", MANUFACTURER, unaffected, "0 damaged, 1 incompatible values, 2 not read after three consecutive watchdog resets, 3 learnt values of another version or damaged";
    /// The configuration could not be stored.
    ConfigStore = 11, 0x6301, "configuration not stored", MANUFACTURER, unaffected, "0 the flash does not read back, 1 the supply is too low";
    /// The program panicked and was restarted.
    Panic = 12, 0x6101, "program panicked", MANUFACTURER, unaffected, "program counter";
    /// The processor took a fault exception and was restarted.
    HardFault = 13, 0x6102, "processor fault", MANUFACTURER, unaffected, "program counter";
    /// The watchdog restarted the board.
    WatchdogReset = 14, 0x6103, "watchdog reset", MANUFACTURER, unaffected, "0";
    /// A tick's work took longer than a tick.
    LateTick = 15, 0x6104, "tick too long", MANUFACTURER, unaffected, "duration, µs";
    /// Received CAN frames were lost.
    CanOverrun = 16, 0x8110, "CAN overrun", COMMUNICATION, unaffected, "minimum number of frames or bytes lost so far";
    /// The CAN controller is error-passive.
    CanErrorPassive = 17, 0x8120, "CAN error-passive", COMMUNICATION, unaffected, "receive and transmit error counter, from the lowest byte";
    /// The CAN controller is bus-off, or was until recently. The emergency message is sent after the recovery.
    CanBusOff = 18, 0x8140, "CAN bus-off", COMMUNICATION, unaffected, "number so far";
    /// A received PDO has the wrong length.
    PdoLength = 19, 0x8210, "received PDO has a wrong length", COMMUNICATION, unaffected, "bytes received";
    /// Received UART bytes were lost.
    UartOverrun = 20, 0x81F0, "UART overrun", COMMUNICATION, unaffected, "minimum number of frames or bytes lost so far";
    /// No load was received over RPDO1 within its event timer.
    PdoTimeout = 21, 0x8250, "received PDO timed out", COMMUNICATION, unaffected, "event timer, ms";
    /// The gyroscope's bias, at rest or by the corrections of a walk, is larger than can be learnt.
    GyroBias = 22, 0x7009, "gyroscope bias too large", MANUFACTURER, unaffected, "angular rate at rest, 0.001 °/s";
    /// The specific force at rest is outside 0.88 to 1.12 g: another part, or a wrong correction.
    SensorScale = 23, 0x700A, "sensor has a wrong scale", MANUFACTURER, void, "specific force at rest, 0.001 g";
    /// A register of the sensor was read wrong, and correctly at the second attempt. The bus has little margin.
    Misread = 24, 0x700B, "misread on the sensor's bus", MANUFACTURER, unaffected, "misreads so far";
    /// Some or all data-ready edges are missing although the sensor has new samples. A timer reads them.
    DataReadyDead = 25, 0x700C, "data-ready line dead", MANUFACTURER, unaffected, "0";
}

impl Fault {
    /// Returns whether the fault voids the estimate while it lasts, because the motion itself is unknown.
    #[must_use]
    pub const fn voids_estimate(self) -> bool {
        VOIDING & 1 << self.number() != 0
    }

    /// Number of the fault, from 0: its bit in [`Faults`].
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The fault with this number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

/// A set of [`Fault`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults(u32);

impl Faults {
    /// No fault.
    pub const NONE: Self = Self(0);

    /// This set with `fault` added.
    #[must_use]
    pub const fn with(self, fault: Fault) -> Self {
        Self(self.0 | 1 << fault.number())
    }

    /// This set with `fault` removed.
    #[must_use]
    pub const fn without(self, fault: Fault) -> Self {
        Self(self.0 & !(1 << fault.number()))
    }

    /// This set without the faults of another.
    #[must_use]
    pub const fn without_all(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Returns whether `fault` is in the set.
    #[must_use]
    pub const fn contains(self, fault: Fault) -> bool {
        self.0 & (1 << fault.number()) != 0
    }

    /// Returns whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The faults in the set.
    pub fn iter(self) -> impl Iterator<Item = Fault> {
        let faults = Fault::ALL.into_iter();
        faults.filter(move |fault| self.contains(*fault))
    }

    /// The set as bits: bit *i* stands for the fault of number *i*.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The set with these bits; bits without a fault are dropped.
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits).iter().fold(Self::NONE, Self::with)
    }

    /// Returns whether any of them [voids](Fault::voids_estimate) the estimate.
    #[must_use]
    pub const fn void_estimate(self) -> bool {
        self.0 & VOIDING != 0
    }

    /// Error register (object 0x1001) while these faults are active.
    #[must_use]
    pub fn register(self) -> u8 {
        self.iter()
            .fold(0, |register, fault| register | ErrorRegister::GENERIC | fault.register_bits())
    }
}

/// An emergency message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Emergency code; 0 if a fault was cleared.
    pub code: u16,
    /// The error register after the change.
    pub register: u8,
    /// Fault of the message. `None` if this version does not know it: no fault has this number, or its code differs.
    pub fault: Option<Fault>,
    /// Detail, with the meaning given by [`Fault::detail`].
    pub detail: u32,
}

impl Emergency {
    /// Message for a raised `fault`; `active` are the faults after the change.
    #[must_use]
    pub fn raised(fault: Fault, detail: u32, active: Faults) -> Self {
        Self {
            code: fault.code(),
            register: active.with(fault).register(),
            fault: Some(fault),
            detail,
        }
    }

    /// Message for a cleared `fault`; `active` are the faults after the change.
    #[must_use]
    pub fn cleared(fault: Fault, active: Faults) -> Self {
        Self {
            code: canopen_rs::emcy::error_code::ERROR_RESET,
            register: active.without(fault).register(),
            fault: Some(fault),
            detail: 0,
        }
    }

    /// Encodes the message.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let number = self.fault.map_or(u8::MAX, Fault::number);
        let [a, b, c, d] = self.detail.to_le_bytes();
        EmergencyMessage::new(self.code, ErrorRegister(self.register), [number, a, b, c, d])
            .encode()
    }

    /// Decodes a message; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [code_low, code_high, register, number, a, b, c, d] = *bytes;
        let code = u16::from_le_bytes([code_low, code_high]);
        Self {
            code,
            register,
            fault: Fault::from_number(number).filter(|fault| code == 0 || fault.code() == code),
            detail: u32::from_le_bytes([a, b, c, d]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_an_emergency() {
        let raised = Emergency::raised(Fault::HardFault, 0x0800_1234, Faults::NONE);
        assert_eq!(raised.encode(), [0x02, 0x61, 0x81, 13, 0x34, 0x12, 0x00, 0x08]);
        let active = Faults::NONE.with(Fault::HardFault).with(Fault::CanBusOff);
        let cleared = Emergency::cleared(Fault::HardFault, active);
        assert_eq!(cleared.encode(), [0, 0, 0x11, 13, 0, 0, 0, 0]);
    }

    #[test]
    fn decoding_restores_the_encoded_emergency() {
        for fault in Fault::ALL {
            let emergency = Emergency::raised(fault, 0xDEAD_BEEF, Faults::NONE);
            assert_eq!(Emergency::decode(&emergency.encode()), emergency);
        }
    }

    #[test]
    fn a_number_that_does_not_match_the_code_gives_no_fault() {
        let mut bytes = Emergency::raised(Fault::LateTick, 0, Faults::NONE).encode();
        bytes[3] = Fault::SensorSilent.number();
        let emergency = Emergency::decode(&bytes);
        assert_eq!((emergency.code, emergency.fault), (0x6104, None));
        bytes[..2].fill(0);
        let cleared = Emergency::decode(&bytes);
        assert_eq!(cleared.fault, Some(Fault::SensorSilent));
    }

    #[test]
    fn bits_without_a_fault_are_dropped() {
        let all = Fault::ALL.into_iter().fold(Faults::NONE, Faults::with);
        assert_eq!(Faults::from_bits(u32::MAX), all);
        assert_eq!(Faults::from_bits(1 << 31), Faults::NONE);
    }

    #[test]
    fn the_register_has_the_bits_of_every_fault_in_the_set() {
        // Bit 0 any error, bit 4 communication, bit 7 everything else (CiA 301).
        let (panic, bus_off) =
            (Faults::NONE.with(Fault::Panic), Faults::NONE.with(Fault::CanBusOff));
        assert_eq!((panic.register(), bus_off.register()), (0x81, 0x11));
        assert_eq!(panic.with(Fault::CanBusOff).register(), 0x91);
        assert_eq!(Faults::NONE.register(), 0);
    }

    #[test]
    fn every_fault_has_its_own_code_and_number() {
        for (number, fault) in (0..).zip(Fault::ALL) {
            assert_eq!(fault.number(), number);
            assert_eq!(Fault::from_number(fault.number()), Some(fault));
            let same = Fault::ALL.into_iter().filter(|f| f.code() == fault.code());
            assert_eq!(same.count(), 1, "{fault:?}");
        }
    }

    #[test]
    fn only_sensor_faults_void_the_estimate() {
        for fault in Fault::ALL {
            let sensor = fault.name().starts_with("sensor");
            assert_eq!(fault.voids_estimate(), sensor, "{fault:?}");
        }
    }
}
