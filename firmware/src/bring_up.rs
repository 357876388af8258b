//! Report of the bring-up program. Each measurement has a line with value, limit and verdict.

use core::fmt::{self, Write};
use core::ops::RangeInclusive;

use heapless::String;
use wire::Diagnosis;
use wire::node::Crash;

/// Longest line, bytes.
pub const LINE: usize = 200;

/// A line of the report.
pub type Line = String<LINE>;

/// Judgement of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Within its limit.
    Pass,
    /// Beyond its limit; the text is the remedy.
    Fail(&'static str),
    /// Not measured; the text is the reason.
    NotTested(&'static str),
}

impl Verdict {
    /// Judges a value. NaN fails.
    #[must_use]
    pub fn of(value: f32, limits: &RangeInclusive<f32>, remedy: &'static str) -> Self {
        Self::when(limits.contains(&value), remedy)
    }

    /// Passes if a condition holds.
    #[must_use]
    pub const fn when(holds: bool, remedy: &'static str) -> Self {
        if holds { Self::Pass } else { Self::Fail(remedy) }
    }
}

/// Counts of the verdicts so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    passed: u16,
    failed: u16,
    not_tested: u16,
}

impl Report {
    /// Counts a measurement, and returns its line. Text beyond [`LINE`] bytes is left out.
    pub fn line(
        &mut self,
        name: &str,
        value: fmt::Arguments<'_>,
        limit: &str,
        verdict: Verdict,
    ) -> Line {
        let mut shown: String<40> = String::new();
        // Here and below, a text that is too long is cut off.
        let _ = shown.write_fmt(value);
        let mut line = Line::new();
        let _ = write!(line, "{name:<24} {shown:<26} {limit:<20} ");
        let _ = match verdict {
            Verdict::Pass => {
                self.passed += 1;
                write!(line, "pass\r\n")
            }
            Verdict::Fail(remedy) => {
                self.failed += 1;
                write!(line, "FAIL: {remedy}\r\n")
            }
            Verdict::NotTested(reason) => {
                self.not_tested += 1;
                write!(line, "not tested: {reason}\r\n")
            }
        };
        line
    }

    /// Last line of the report.
    #[must_use]
    pub fn summary(&self) -> Line {
        let Self { passed, failed, not_tested } = self;
        let mut line = Line::new();
        let _ = write!(
            line,
            "passed {passed}, failed {failed}, not tested {not_tested}; any byte received here starts again\r\n"
        );
        line
    }
}

/// Values of a board that are known before a foot runs on it.
#[derive(Clone, Copy, Debug)]
pub struct BoardReport {
    /// Name of the board.
    pub board: &'static str,
    /// Serial number of the board.
    pub serial: u32,
    /// First digits of this program's commit; 0 if no commit has its sources.
    pub program: u32,
    /// Crash before this start.
    pub crash: Option<Crash>,
    /// The board and its sensor.
    pub diagnosis: Diagnosis,
    /// Level of the brown-out reset in effect; 0 if it is off.
    pub brown_out_level: u8,
    /// Deepest use of the stack, bytes.
    pub stack_bytes: usize,
}

/// Length of a board's report, bytes, without and with the ends of lines for a terminal.
const BOARD_REPORT: usize = 1_100;
const BOARD_TEXT: usize = 1_150;

impl BoardReport {
    /// Lines of the report, with the names that `footfall foot … report` uses. That command also prints lines about a foot.
    #[must_use]
    pub fn text(&self) -> String<BOARD_TEXT> {
        let mut shown: String<BOARD_REPORT> = String::new();
        // Both texts have room for the longest numbers: see the test.
        let _ = self.write(&mut shown);
        let mut text = String::new();
        for line in shown.lines() {
            let _ = write!(text, "{line}\r\n");
        }
        text
    }

    fn write(&self, to: &mut String<BOARD_REPORT>) -> fmt::Result {
        writeln!(
            to,
            "device   bring-up, {} board, serial number 0x{:08X}",
            self.board, self.serial
        )?;
        write!(to, "version  {}", env!("CARGO_PKG_VERSION"))?;
        match self.program {
            0 => writeln!(to)?,
            program => writeln!(to, ", program {program:08X}")?,
        }
        match self.crash {
            None => writeln!(to, "crash    none")?,
            Some(Crash { fault, program_counter }) => {
                writeln!(to, "crash    {} at 0x{program_counter:08X}", fault.name())?;
            }
        }
        writeln!(to, "{}", self.diagnosis)?;
        writeln!(to, "supply   brown-out level {}", self.brown_out_level)?;
        writeln!(to, "costs    stack {} bytes", self.stack_bytes)
    }
}

/// Permitted supply, mV. The chip takes 1.8 to 3.6 V, and needs 2.7 V to write its flash by words (DS8626, general
/// operating conditions \[M\]). Transceivers for 3.3 V are specified from 3.0 V on.
pub const SUPPLY_MV: RangeInclusive<u32> = 3_000..=3_600;

/// Supply at which the factory converts the chip's reference, mV (DS8626, internal reference voltage calibration
/// values \[M\]).
const CALIBRATION_MV: u32 = 3_300;

/// Plausible codes of that conversion: 1.18 to 1.24 V of 3.3 V (DS8626, embedded internal reference voltage \[M\]),
/// plus 1 % for the converter.
const CALIBRATION_CODES: RangeInclusive<u16> = 1_450..=1_555;

/// Supply, mV, from two codes of the chip's voltage reference: the present one, and the one stored by the factory.
/// `None` if a code is impossible.
#[must_use]
pub fn supply_mv(code: u16, calibration: u16) -> Option<u32> {
    if !CALIBRATION_CODES.contains(&calibration) {
        return None;
    }
    (CALIBRATION_MV * u32::from(calibration)).checked_div(u32::from(code))
}

/// Edges of the sensor's data-ready line, tick by tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    ticks: u32,
    edges: u32,
    without: u32,
}

impl Edges {
    /// Counts the edges of a tick.
    pub fn take(&mut self, edges: u16) {
        self.ticks += 1;
        self.edges += u32::from(edges);
        self.without += u32::from(edges == 0);
    }

    /// Number of edges.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.edges
    }

    /// Mean interval of the edges, µs; infinite without any edge.
    #[must_use]
    pub fn interval_us(&self) -> f32 {
        1000.0 * self.ticks as f32 / self.edges as f32
    }

    /// Number of ticks without an edge.
    #[must_use]
    pub const fn without(&self) -> u32 {
        self.without
    }
}

/// Jitter of the data-ready line, from the first edge of each tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    interval_us: f32,
    last_us: Option<u64>,
    largest_us: f32,
}

impl Jitter {
    /// Starts with the mean interval of the edges.
    #[must_use]
    pub const fn new(interval_us: f32) -> Self {
        Self { interval_us, last_us: None, largest_us: f32::NAN }
    }

    /// Takes the time of an edge. The distance to the previous edge should be a multiple of the interval.
    pub fn take(&mut self, at_us: u64) {
        if let Some(last_us) = self.last_us.replace(at_us) {
            let intervals = at_us.saturating_sub(last_us) as f32 / self.interval_us;
            let whole = (intervals + 0.5) as u32 as f32;
            let off_us = (intervals - whole).abs() * self.interval_us;
            self.largest_us = self.largest_us.max(off_us);
        }
    }

    /// Largest deviation, µs; NaN before the second edge, and without an interval.
    #[must_use]
    pub const fn largest_us(&self) -> f32 {
        self.largest_us
    }
}

/// Mean and scatter of samples at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// The first sample. The sums hold differences from it, which are small.
    first: [f32; 3],
    count: u16,
    sums: [f32; 3],
    squares: f32,
}

impl Scatter {
    /// Takes a sample of three axes.
    pub fn take(&mut self, axes: [f32; 3]) {
        if self.count == 0 {
            self.first = axes;
        }
        self.count += 1;
        for ((value, first), sum) in axes.into_iter().zip(self.first).zip(&mut self.sums) {
            *sum += value - first;
            self.squares += (value - first) * (value - first);
        }
    }

    /// Number of samples.
    #[must_use]
    pub const fn count(&self) -> u16 {
        self.count
    }

    /// Mean of each axis; NaN without a sample.
    #[must_use]
    pub fn mean(&self) -> [f32; 3] {
        let mut mean = self.first;
        for (mean, sum) in mean.iter_mut().zip(self.sums) {
            *mean += sum / f32::from(self.count);
        }
        mean
    }

    /// Variance of all axes together.
    #[must_use]
    pub fn variance(&self) -> f32 {
        let of_means: f32 = self.sums.iter().map(|sum| sum * sum).sum();
        let count = f32::from(self.count);
        (self.squares - of_means / count) / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::Fault;

    #[test]
    fn supply_is_the_ratio_to_the_code_of_the_factory() {
        assert_eq!(supply_mv(1_500, 1_500), Some(3_300));
        assert_eq!(supply_mv(1_707, 1_500), Some(2_899));
        assert_eq!(supply_mv(0, 1_500), None);
        assert_eq!(supply_mv(1_500, 0xFFFF), None);
    }

    #[test]
    fn line_has_name_value_limit_verdict_and_remedy() {
        let mut report = Report::default();
        let line = report.line("stack", format_args!("{} B", 700), "below 4096", Verdict::Pass);
        assert_eq!(
            line.split_whitespace().collect::<Vec<_>>(),
            ["stack", "700", "B", "below", "4096", "pass"]
        );
        let line = report.line("CAN", format_args!("silent"), "", Verdict::Fail("add a node"));
        assert!(line.ends_with("FAIL: add a node\r\n"), "{line}");
        report.line("", format_args!(""), "", Verdict::NotTested("no sensor"));
        assert!(report.summary().starts_with("passed 1, failed 1, not tested 1;"));
    }

    #[test]
    fn longest_report_of_a_board_is_shown_whole() {
        let mut diagnosis = Diagnosis::default();
        for subindex in 2..=Diagnosis::HIGHEST_SUBINDEX {
            // The values with the most digits of their types. The longest mean is the most negative one.
            diagnosis.set_raw(subindex, if subindex < 25 { u32::MAX } else { 0x8000 });
        }
        let longest = Fault::ALL.into_iter().max_by_key(|fault| fault.name().len());
        let fault = longest.expect("there are faults");
        let report = BoardReport {
            board: "reference",
            serial: u32::MAX,
            program: u32::MAX,
            crash: Some(Crash { fault, program_counter: u32::MAX }),
            diagnosis,
            brown_out_level: 3,
            stack_bytes: usize::MAX,
        };
        let text = report.text();
        let names: Vec<&str> = text.lines().filter_map(|line| line.split(' ').next()).collect();
        let of_diagnosis = ["reset", "clock", "options", "chip", "sensor", "bus", "noise", "mean"];
        let expected =
            [&["device", "version", "crash"][..], &of_diagnosis, &["supply", "costs"]].concat();
        assert_eq!(names, expected);
        assert!(text.contains("wz -32768 codes, in the same ticks\r\n"), "{text}");
        assert!(text.ends_with(&format!("costs    stack {} bytes\r\n", usize::MAX)), "{text}");
        let report = BoardReport { program: 0, crash: None, ..report };
        assert!(report.text().contains("\r\nversion  0.1.0\r\ncrash    none\r\n"));
    }

    #[test]
    fn text_that_is_too_long_ends_early() {
        let long = "x".repeat(300);
        let mut report = Report::default();
        let line = report.line(&long, format_args!("{long}"), &long, Verdict::Pass);
        assert!(line.len() <= LINE);
        assert_eq!(report, Report { passed: 1, ..Report::default() });
    }

    #[test]
    fn value_at_its_limit_passes_and_no_number_fails() {
        let limits = 142.5..=157.5;
        assert_eq!(Verdict::of(157.5, &limits, ""), Verdict::Pass);
        for value in [157.6, f32::NAN, f32::INFINITY] {
            assert_eq!(Verdict::of(value, &limits, "wires"), Verdict::Fail("wires"));
        }
    }

    #[test]
    fn interval_is_that_of_the_edges_counted() {
        let mut edges = Edges::default();
        assert!(edges.interval_us().is_nan());
        [7, 6, 7, 0].into_iter().for_each(|count| edges.take(count));
        assert_eq!((edges.interval_us(), edges.without()), (200.0, 1));
    }

    #[test]
    fn jitter_is_the_largest_distance_from_whole_intervals() {
        let mut jitter = Jitter::new(150.0);
        [1_000, 1_900, 2_953, 3_850].into_iter().for_each(|at| jitter.take(at));
        assert!((jitter.largest_us() - 3.0).abs() < 1e-3, "{jitter:?}");
    }

    #[test]
    fn scatter_has_the_mean_and_variance_of_its_samples() {
        let mut scatter = Scatter::default();
        assert!(scatter.mean()[0].is_nan() && scatter.variance().is_nan());
        // Deviations of 0.3, 0 and 0.4.
        [-1.0, 1.0, -1.0, 1.0]
            .into_iter()
            .for_each(|sign| scatter.take([0.3 * sign, 5.0, 9.8 + 0.4 * sign]));
        let [x, y, z] = scatter.mean();
        assert!(x.abs() < 1e-6 && y == 5.0 && (z - 9.8).abs() < 1e-5);
        assert!((scatter.variance() - 0.25).abs() < 1e-5, "{scatter:?}");
    }
}
