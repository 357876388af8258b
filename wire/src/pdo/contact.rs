//! TPDO1: the contact, each tick.

use estimator_core::{ContactEstimate, Decision, Flag, Flags, Phase};

use super::code::{P8, P16, ShortTime};
use super::field::{Field, Signal, TIMESTAMP};
use crate::address::index;
use crate::fault::Faults;
use crate::value::Value;

/// The status byte.
///
/// | bits | field |
/// |---|---|
/// | 0 to 2 | phase: 0 unknown, 1 stance, 2 slip, 3 swing, 4 quiet swing, 5 landing; a reader takes 6 and 7 for unknown |
/// | 3 | debounced decision: stable |
/// | 4 | valid: no fault, and no flag other than a time gap or settling |
/// | 5 | saturated |
/// | 6 | fault: the sensor cannot be trusted |
/// | 7 | starting: the window is not full, or up is not yet known |
///
/// A status that is not valid never reports "stable", whatever its source or its bits: neither as decision nor as a
/// phase that implies it. With a fault the phase is unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(u8);

const DECISION: u8 = 1 << 3;
const VALID: u8 = 1 << 4;
const SATURATED: u8 = 1 << 5;
const FAULT: u8 = 1 << 6;
const STARTING: u8 = 1 << 7;

impl Status {
    /// Creates the status of an estimate while `faults` are active.
    #[must_use]
    pub fn new(decision: Decision, phase: Phase, flags: Flags, faults: Faults) -> Self {
        let mut bits = phase as u8;
        if decision == Decision::Stable {
            bits |= DECISION;
        }
        if faults.void_estimate() {
            bits |= FAULT;
        } else if !flags.are_doubt() {
            bits |= VALID;
        }
        if flags.contains(Flag::Saturated) {
            bits |= SATURATED;
        }
        if flags.contains(Flag::WindowNotFull) || flags.contains(Flag::AttitudeNotInitialised) {
            bits |= STARTING;
        }
        Self::from_bits(bits)
    }

    /// Creates the status with these bits, except those that contradict an invalid status.
    #[must_use]
    pub fn from_bits(bits: u8) -> Self {
        let doubtful = FAULT | SATURATED | STARTING;
        let mut status = Self(bits);
        if bits & doubtful != 0 {
            status.0 &= !VALID;
        }
        if !status.is_valid() {
            status.0 &= !DECISION;
            let rests = matches!(status.phase(), Phase::Stance | Phase::QuietSwing);
            // With a fault, the motion of the foot is unknown as well.
            if rests || status.has_fault() {
                status.0 = status.0 & !PHASE | Phase::Unknown as u8;
            }
        }
        status
    }

    /// Bits of the status.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Phase; unknown for an invalid code.
    #[must_use]
    pub fn phase(self) -> Phase {
        let code = usize::from(self.0 & PHASE);
        Phase::ALL.get(code).copied().unwrap_or(Phase::Unknown)
    }

    /// Debounced decision.
    #[must_use]
    pub const fn decision(self) -> Decision {
        if self.0 & DECISION != 0 { Decision::Stable } else { Decision::NotStable }
    }

    /// Returns whether the estimate is valid.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        self.0 & VALID != 0
    }

    /// Returns whether the newest sample is at the end of the sensor's range.
    #[must_use]
    pub const fn is_saturated(self) -> bool {
        self.0 & SATURATED != 0
    }

    /// Returns whether a fault voids the estimate.
    #[must_use]
    pub const fn has_fault(self) -> bool {
        self.0 & FAULT != 0
    }

    /// Returns whether the window is not full or up is not yet known.
    #[must_use]
    pub const fn is_starting(self) -> bool {
        self.0 & STARTING != 0
    }
}

const PHASE: u8 = 0b111;

/// The contents of TPDO1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Probability of stable contact.
    pub stable: P16,
    /// Probability of no motion along the ground.
    pub tangential: P8,
    /// Probability of no lifting.
    pub vertical: P8,
    /// Acquisition time of the sample.
    pub timestamp: ShortTime,
    /// Sequence number, incremented with each frame.
    pub sequence: u8,
    /// Phase, decision and their validity.
    pub status: Status,
}

impl Contact {
    /// Creates the frame for an estimate while `faults` are active. With a fault that
    /// [voids](crate::Fault::voids_estimate) the estimate every probability is 0.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, sequence: u8, faults: Faults) -> Self {
        let probabilities = if faults.void_estimate() {
            estimator_core::Probabilities::default()
        } else {
            estimate.probabilities
        };
        Self {
            stable: P16::new(probabilities.stable),
            tangential: P8::new(probabilities.tangential),
            vertical: P8::new(probabilities.vertical),
            timestamp: estimate.timestamp.into(),
            sequence,
            status: Status::new(estimate.decision, estimate.phase, estimate.flags, faults),
        }
    }

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [stable_low, stable_high] = self.stable.0.to_le_bytes();
        let [time_low, time_high] = self.timestamp.0.to_le_bytes();
        [
            stable_low,
            stable_high,
            self.tangential.0,
            self.vertical.0,
            time_low,
            time_high,
            self.sequence,
            self.status.bits(),
        ]
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [stable_low, stable_high, tangential, vertical, time_low, time_high, sequence, status] =
            *bytes;
        Self {
            stable: P16(u16::from_le_bytes([stable_low, stable_high])),
            tangential: P8(tangential),
            vertical: P8(vertical),
            timestamp: ShortTime(u16::from_le_bytes([time_low, time_high])),
            sequence,
            status: Status::from_bits(status),
        }
    }
}

/// Names of the phases, by code.
const PHASES: &[(u8, &str)] = &[
    (0, Phase::Unknown.name()),
    (1, Phase::Stance.name()),
    (2, Phase::Slip.name()),
    (3, Phase::Swing.name()),
    (4, Phase::QuietSwing.name()),
    (5, Phase::Landing.name()),
];

pub(super) const FIELDS: [Field; 6] = [
    Field::new(
        index::CONTACT,
        1,
        "Stable contact probability",
        Value::U16(0),
        &[Signal::probability(
            "StableContactProbability",
            16,
            "Probability that the foot is in stable contact. 0 with a fault.",
        )],
    )
    .unit("1/65535"),
    Field::new(
        index::CONTACT,
        2,
        "Tangential probability",
        Value::U8(0),
        &[Signal::probability(
            "TangentialProbability",
            8,
            "Probability of no motion along the ground. 0 with a fault.",
        )],
    )
    .unit("1/255"),
    Field::new(
        index::CONTACT,
        3,
        "Vertical probability",
        Value::U8(0),
        &[Signal::probability(
            "VerticalProbability",
            8,
            "Probability of no lifting, with half-widths also of no tilting. 0 with a fault.",
        )],
    )
    .unit("1/255"),
    TIMESTAMP,
    Field::new(
        index::CONTACT,
        5,
        "Sequence",
        Value::U8(0),
        &[Signal::unsigned(
            "Sequence",
            8,
            1.0,
            "",
            "Incremented with each frame, sent or dropped; wraps after 255.",
        )],
    ),
    Field::new(
        index::CONTACT,
        6,
        "Status",
        Value::U8(0),
        &[
            Signal::named(
                "State",
                3,
                PHASES,
                "Phase of the gait; unknown without a load signal or in doubt.",
            ),
            Signal::named(
                "Decision",
                1,
                &[(0, "not_stable"), (1, "stable")],
                "Debounced decision; stable only if Valid is yes.",
            ),
            Signal::flag("Valid", "No fault, and no flag other than a time gap or settling."),
            Signal::flag("Saturated", "The newest sample is at the end of the sensor's range."),
            Signal::flag("Fault", "The sensor cannot be trusted; the EMCY message has the reason."),
            Signal::flag("Starting", "The window is not full, or up is not yet known."),
        ],
    )
    .doc("bits as in TPDO1"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use estimator_core::{Probabilities, Timestamp};

    fn estimate() -> ContactEstimate {
        ContactEstimate {
            timestamp: Timestamp::from_micros(1_234_567),
            probabilities: Probabilities {
                stable: 0.75,
                tangential: 1.0,
                vertical: 0.5,
                ..Default::default()
            },
            decision: Decision::Stable,
            phase: Phase::Stance,
            ..Default::default()
        }
    }

    #[test]
    fn golden_bytes() {
        let bytes = Contact::new(&estimate(), 200, Faults::NONE).encode();
        // 0.75 × 65535 = 49151.25; 123456 steps modulo 2¹⁶ = 0xE240; valid, stable, stance.
        assert_eq!(bytes, [0xFF, 0xBF, 0xFF, 0x80, 0x40, 0xE2, 200, 0x19]);
    }

    #[test]
    fn decoding_restores_the_encoded_contact() {
        let contact = Contact::new(&estimate(), 9, Faults::NONE);
        assert_eq!(Contact::decode(&contact.encode()), contact);
    }

    #[test]
    fn a_sensor_fault_forces_every_probability_to_zero() {
        for fault in Fault::ALL.into_iter().filter(|f| f.voids_estimate()) {
            let contact = Contact::new(&estimate(), 0, Faults::NONE.with(fault));
            assert_eq!(contact.stable.0, 0);
            assert_eq!((contact.tangential.0, contact.vertical.0), (0, 0));
            assert!(contact.status.has_fault() && !contact.status.is_valid());
            assert_eq!(contact.status.decision(), Decision::NotStable);
            assert_eq!(contact.status.phase(), Phase::Unknown);
        }
    }

    #[test]
    fn a_uart_fault_leaves_the_estimate_valid() {
        let faults = Faults::NONE.with(Fault::UartOverrun);
        let contact = Contact::new(&estimate(), 0, faults);
        assert!(contact.status.is_valid() && !contact.status.has_fault());
        assert_eq!(contact.status.decision(), Decision::Stable);
    }

    #[test]
    fn only_a_gap_or_settling_leaves_the_frame_valid() {
        let harmless = |flag: &Flag| matches!(flag, Flag::TimeGap | Flag::Settling);
        for flag in Flag::ALL.into_iter().filter(harmless) {
            let contact = ContactEstimate { flags: Flags::NONE.with(flag), ..estimate() };
            let status = Contact::new(&contact, 0, Faults::NONE).status;
            assert!(status.is_valid() && !status.is_starting(), "{flag:?}");
            assert_eq!(status.decision(), Decision::Stable, "{flag:?}");
        }
        for flag in Flag::ALL.into_iter().filter(|flag| !harmless(flag)) {
            let doubtful = ContactEstimate { flags: Flags::NONE.with(flag), ..estimate() };
            let status = Contact::new(&doubtful, 0, Faults::NONE).status;
            assert!(!status.is_valid(), "{flag:?}");
            assert_eq!(status.decision(), Decision::NotStable, "{flag:?}");
        }
    }

    #[test]
    fn saturated_and_starting_follow_their_flags() {
        for (flag, is_saturated, is_starting) in [
            (Flag::Saturated, true, false),
            (Flag::WindowNotFull, false, true),
            (Flag::AttitudeNotInitialised, false, true),
            (Flag::Stale, false, false),
            (Flag::InvalidSample, false, false),
        ] {
            let doubtful = ContactEstimate { flags: Flags::NONE.with(flag), ..estimate() };
            let status = Contact::new(&doubtful, 0, Faults::NONE).status;
            let found = (status.is_saturated(), status.is_starting());
            assert_eq!(found, (is_saturated, is_starting), "{flag:?}");
        }
    }

    #[test]
    fn an_invalid_status_never_reports_stable() {
        for bits in 0..=u8::MAX {
            let status = Status::from_bits(bits);
            let stable = status.decision() == Decision::Stable
                || matches!(status.phase(), Phase::Stance | Phase::QuietSwing);
            assert!(status.is_valid() || !stable, "{bits:#010b}");
            if status.has_fault() {
                assert_eq!(status.phase(), Phase::Unknown, "{bits:#010b}");
            }
            if status.has_fault() || status.is_saturated() || status.is_starting() {
                assert!(!status.is_valid(), "{bits:#010b}");
            }
        }
    }
}
