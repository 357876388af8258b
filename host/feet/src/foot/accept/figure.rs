//! Quantities that are measured, with their limits, and the figures found.

use wire::board::EDGE_TO_MAILBOX_US;

use super::AcceptStep;

/// A quantity with its limits, and the remedy if a value is out of them.
#[derive(Debug, PartialEq)]
pub struct LimitedQuantity {
    /// Step in which it is measured.
    pub step: AcceptStep,
    /// Name.
    pub name: &'static str,
    /// Unit; empty for counts and codes.
    pub unit: &'static str,
    /// Least accepted value; −∞ without one.
    pub lowest: f64,
    /// Greatest accepted value; ∞ without one.
    pub highest: f64,
    /// Origin of the limits.
    pub source: &'static str,
    /// Remedy for a value out of the limits; empty if the hint suffices.
    pub remedy: &'static str,
    /// Remedy that depends on the program.
    pub hint: Option<FigureHint>,
}

/// Remedy of a value out of its limits that depends on the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureHint {
    /// Look up the remedy of each fault.
    ExplainFaults,
    /// Look up the name of the code.
    ExplainCode,
    /// Watch the contacts, whose flags and faults have names.
    WatchContacts,
    /// Calibrate bias and scale of the accelerometer from rests.
    CalibrateRests,
}

/// Value of a quantity, or the reason why it has none.
#[derive(Clone, Debug, PartialEq)]
pub enum FigureOutcome {
    /// Measured value, in the unit of its [`LimitedQuantity`].
    Measured(f64),
    /// Reason why the measurement failed. It counts as a fault of the board until a repeated measurement succeeds.
    Failed(String),
    /// Reason why there was nothing to measure.
    NotTested(String),
}

/// A quantity with its outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The quantity.
    pub limit: &'static LimitedQuantity,
    /// The outcome.
    pub outcome: FigureOutcome,
    /// Details of the value, such as the names of faults. May be empty.
    pub detail: String,
}

samples::named! {
    /// Judgement of a figure, with its name in reports.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Verdict {
        /// Within the limits.
        Pass = "pass",
        /// Out of the limits, or not measurable.
        Out = "OUT",
        /// Nothing to measure.
        NotTested = "not tested",
    }
}

impl LimitedQuantity {
    pub(super) fn measured(&'static self, value: f64) -> Figure {
        self.with_outcome(FigureOutcome::Measured(value))
    }

    pub(super) fn counted(&'static self, count: usize) -> Figure {
        self.measured(count as f64)
    }

    pub(super) fn failed(&'static self, reason: &str) -> Figure {
        self.with_outcome(FigureOutcome::Failed(reason.to_owned()))
    }

    pub(super) fn not_tested(&'static self, reason: &str) -> Figure {
        self.with_outcome(FigureOutcome::NotTested(reason.to_owned()))
    }

    const fn with_outcome(&'static self, outcome: FigureOutcome) -> Figure {
        Figure { limit: self, outcome, detail: String::new() }
    }

    /// Limits as text, such as `9.3 to 10.3`.
    #[must_use]
    pub fn range(&self) -> String {
        let (lowest, highest) = (self.lowest, self.highest);
        match (lowest.is_finite(), highest.is_finite()) {
            (true, true) if lowest == highest => format!("{lowest}"),
            (true, true) => format!("{lowest} to {highest}"),
            (true, false) => format!("at least {lowest}"),
            (false, true) => format!("at most {highest}"),
            (false, false) => String::new(),
        }
    }
}

impl Figure {
    /// Adds the parts of the value.
    pub(super) fn with(mut self, detail: String) -> Self {
        self.detail = detail;
        self
    }

    /// Judges the figure; a value that is not a number is out.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let accepted = self.limit.lowest..=self.limit.highest;
        match self.outcome {
            FigureOutcome::Measured(value) if accepted.contains(&value) => Verdict::Pass,
            FigureOutcome::Measured(_) | FigureOutcome::Failed(_) => Verdict::Out,
            FigureOutcome::NotTested(_) => Verdict::NotTested,
        }
    }
}

macro_rules! hint {
    () => {
        None
    };
    ($hint:ident) => {
        Some(FigureHint::$hint)
    };
}

/// Defines the quantities by step, name, unit, least and greatest accepted value, origin of the limits, remedy, and hint
/// if there is one; and [`LIMITS`], which has all of them.
macro_rules! limits {
    ($($limit:ident: $step:ident, $name:literal, $unit:literal, $lowest:expr, $highest:expr, $source:literal, $remedy:literal $(, $hint:ident)?;)+) => {
        $(pub(super) static $limit: LimitedQuantity = LimitedQuantity {
            step: AcceptStep::$step,
            name: $name,
            unit: $unit,
            lowest: $lowest,
            highest: $highest,
            source: $source,
            remedy: $remedy,
            hint: hint!($($hint)?),
        };)+

        /// All quantities, in the order of their steps.
        pub static LIMITS: [&LimitedQuantity; [$($name),+].len()] = [$(&$limit),+];
    };
}

const NONE: f64 = f64::NEG_INFINITY;
const ANY: f64 = f64::INFINITY;

limits! {
    FAULTS: Board, "active faults", "", 0.0, 0.0,
        "a board without faults",
        "", ExplainFaults;
    CRASH: Board, "last crash", "", 0.0, 0.0,
        "code of the emergency; 0: no crash",
        "switch the board off and on, and repeat", ExplainCode;
    BROWN_OUT: Board, "brown-out level", "", 3.0, 3.0,
        "the chip's clock needs 2.7 V (DS8626)",
        "switch the board off and on once: the first start sets the level";
    TEMPERATURE: Board, "sensor temperature", "°C", 0.0, 60.0,
        "temperature of a room, and the part's own heat; the part takes −40 to 85 °C (DS12814)",
        "let the board come to the temperature of the room";
    TO_MAILBOX: Board, "edge to mailbox", "µs", 0.0, EDGE_TO_MAILBOX_US as f64,
        "budget of the latency; the longest since power-up, by the board's timer; 0 without CAN",
        "storing settings increases it: switch the board off and on, and repeat; if it remains, the clock or the program is a different one";
    TO_END: Board, "edge to end of work", "%", 0.0, 80.0,
        "share of the time between ticks, without the wait for the edge; the longest since power-up",
        "storing settings or a fault of the sensor increases it: switch the board off and on, and repeat";
    STACK: Board, "stack used", "bytes", 0.0, 40_960.0,
        "the smallest stack is 48 KiB; the maximum depth since power-up",
        "report it";
    SELF_TEST: SelfTest, "axes that failed", "", 0.0, 0.0,
        "self-test of the sensor (DS12814)",
        "repeat it with the foot still; if it fails again, replace the sensor";
    CONTACT_RATE: Still, "contact rate", "%", 99.9, 100.1,
        "share of the set rate, or of the rate of ticks if that is lower; by the foot's clock",
        "check late ticks and missing contacts";
    DATA_RATE: Still, "data rate of the sensor", "Hz", 6_333.0, 7_000.0,
        "6667 Hz ± 5 %, measured against the board's crystal",
        "replace the sensor; if contacts are also far from 1000 a second, the crystal is a different one";
    MISSING: Still, "missing contacts", "%", 0.0, 0.1,
        "gaps in the numbers of the contacts",
        "check termination and ground of the bus, the adapter, and what else this machine does";
    VALID: Still, "valid contacts", "%", 99.9, 100.0,
        "share without a fault and without a flag of doubt",
        "", WatchContacts;
    STABLE: Still, "stable contacts", "%", 99.0, 100.0,
        "a foot at rest",
        "keep the table free of vibration; then compare noise and bias";
    FORCE: Still, "specific force at rest", "m/s²", 9.32, 10.30,
        "gravity ± 5 %: offset 20 mg, sensitivity 1 % (DS12814), and soldering",
        "half or twice as much means another part, such as an LSM6DSO32", CalibrateRests;
    FORCE_NOISE: Still, "noise of the accelerometer", "m/s²", 0.002, 0.1,
        "below half a code, whose step is 0.005 m/s², an axis may be reported as frozen; 110 µg/√Hz (DS12814) gives about 0.025",
        "too much: vibration or supply; too little: a filter is set wrongly";
    RATE_NOISE: Still, "noise of the gyroscope", "°/s", 0.02, 0.5,
        "below a quarter of a code, whose step is 0.07 °/s, a sound axis may be reported as frozen; 3.8 mdps/√Hz (DS12814) gives about 0.09",
        "too much: vibration or supply; too little: a filter is set wrongly";
    BIAS: Still, "bias of the gyroscope", "°/s", 0.0, 6.0,
        "zero-rate level 1 °/s (DS12814); more than 6 is fault 0x7009",
        "replace the sensor";
    MISSED: Still, "missed samples", "", 0.0, 0.0,
        "counter of the board",
        "check the wires of SPI and INT1, and their length";
    RESTARTS: Still, "sensor restarts", "", 0.0, 0.0,
        "counter of the board",
        "check the supply of the sensor and the wires of SPI and INT1";
    LATE: Still, "late ticks", "", 0.0, 0.0,
        "counter of the board",
        "the clock is not that of the board, or the program is a different one";
    DROPPED: Still, "dropped frames", "", 0.0, 0.0,
        "counters of the board, CAN and UART",
        "too much other traffic, or no acknowledgement: check the bus";
    SIDES: Sides, "sides", "", 6.0, 6.0,
        "six sides",
        "an axis without a side is stuck, or wired to another";
    SIDE_LEAST: Sides, "least force on a side", "m/s²", 9.32, 10.30,
        "as at rest",
        "", CalibrateRests;
    SIDE_MOST: Sides, "greatest force on a side", "m/s²", 9.32, 10.30,
        "as at rest",
        "", CalibrateRests;
    TURN_X: Sides, "error of a turn about x", "°", 0.0, 5.0,
        "gyroscope against gravity: sensitivity 1 % (DS12814), bias, and the hand",
        "turn it slower; more than 20: an axis has the wrong sign or scale, see mounting";
    TURN_Y: Sides, "error of a turn about y", "°", 0.0, 5.0,
        "gyroscope against gravity: sensitivity 1 % (DS12814), bias, and the hand",
        "turn it slower; more than 20: an axis has the wrong sign or scale, see mounting";
    TURN_Z: Sides, "error of a turn about z", "°", 0.0, 5.0,
        "gyroscope against gravity: sensitivity 1 % (DS12814), bias, and the hand",
        "turn it slower; more than 20: an axis has the wrong sign or scale, see mounting";
    TAPS: Taps, "taps seen", "", 5.0, ANY,
        "five taps",
        "tap harder; is the sensor's board fixed to the foot?";
    TAP_RECOVERY: Taps, "longest time back to stable", "ms", NONE, 1000.0,
        "window and debouncing",
        "something still moves after a tap: fix the sensor's board and its wires";
    CLIPPED: Taps, "clipped contacts", "", 0.0, 50.0,
        "10 ms for each tap at ± 16 g",
        "tap softer; the sensor's board may ring";
    STEPS: Steps, "steps seen", "", 10.0, ANY,
        "ten steps",
        "leave the foot on the ground for half a second in each step";
    STEPS_VALID: Steps, "valid contacts in steps", "%", 95.0, 100.0,
        "impacts of 10 ms may clip",
        "", WatchContacts;
    SETTLED: Steps, "calibration settled", "", 1.0, 1.0,
        "1: the learnt values have settled",
        "take more steps; 2: learning is off";
    LOADS: Load, "loads seen", "", 3.0, ANY,
        "three loads",
        "check source, scale and thresholds of the load input";
    LOAD_KNOWN: Load, "contacts with a known load", "%", 99.0, 100.0,
        "over CAN, a load each 100 ms, or within the time that 0x1400:5 sets",
        "the robot has to send RPDO1";
    DETECTED: Unplug, "time to a fault", "ms", 0.0, 100.0,
        "fault matrix of the virtual board",
        "the board trusts a missing sensor: report it";
    STABLE_UNPLUGGED: Unplug, "stable contacts without a sensor", "", 0.0, 0.0,
        "with doubtful data the board never says \"stable\"",
        "do not use this board: report it";
    RECOVERED: Unplug, "recovered", "", 1.0, 1.0,
        "1: contacts are valid again",
        "switch the board off and on";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figure_at_a_limit_passes_and_beyond_it_is_out() {
        for (value, expected) in [
            (9.31, Verdict::Out),
            (9.32, Verdict::Pass),
            (10.30, Verdict::Pass),
            (10.31, Verdict::Out),
            (f64::NAN, Verdict::Out),
        ] {
            assert_eq!(FORCE.measured(value).verdict(), expected, "{value}");
        }
        assert_eq!(FORCE.not_tested("").verdict(), Verdict::NotTested);
    }

    #[test]
    fn quantities_have_unique_names_within_their_ordered_steps() {
        assert!(LIMITS.is_sorted_by_key(|limit| limit.step));
        for (index, limit) in LIMITS.iter().enumerate() {
            let is_same =
                |other: &&LimitedQuantity| (other.step, other.name) == (limit.step, limit.name);
            assert!(!LIMITS[..index].iter().any(is_same), "{}", limit.name);
            assert!(limit.lowest <= limit.highest, "{}", limit.name);
            assert!(!limit.remedy.is_empty() || limit.hint.is_some(), "{}", limit.name);
        }
    }

    #[test]
    fn range_is_worded_by_the_limits_there_are() {
        assert_eq!(FORCE.range(), "9.32 to 10.3");
        assert_eq!(SIDES.range(), "6");
        assert_eq!(TAPS.range(), "at least 5");
        assert_eq!(TAP_RECOVERY.range(), "at most 1000");
    }
}
