//! Tables with a header: `t,ax,ay,az,wx,wy,wz,force,label,validity` in any order, of which the six
//! axes are required.
//!
//! | column | unit | blank cell |
//! |---|---|---|
//! | `t` | s, from any start, advancing by at least 1 µs per row | error |
//! | `ax`, `ay`, `az` | m/s², gravity included unless said otherwise | error |
//! | `wx`, `wy`, `wz` | rad/s | error |
//! | `force` | N | no load known |
//! | `label` | 1 stable, 0 not stable | truth not known |
//! | `validity` | a name of [`VALIDITIES`]: what the source knew about the sample | valid |
//!
//! Other columns are ignored, and named in a notice. The sample rate is that of the times between
//! rows without the gaps: the roundest number of Hz that they allow. Or it is the one that is
//! given; where there are both they agree within 1 %.

use estimator_core::{Axis, Gravity, Load, Saturation, Timestamp, Validity};

use super::error::{HeaderSlip, InputError};
use super::table::{Row, Table};
use super::{Correction, Hints, Loaded, imu_sample, steady_time};
use crate::recording::{Label, RecordedSample, Recording};

/// By how much a given sample rate may differ from that of the times, as a fraction.
const RATE_TOLERANCE: f64 = 0.01;

/// Times must lie within this of zero, s, so that microseconds are exact: up to here an f64 holds
/// a decimal number to half a microsecond. Seconds since 1970 reach it in 2096.
pub(super) const MAX_TIME_S: f64 = 4.0e9;

/// Said where times make sense as milliseconds only.
pub(crate) const MILLISECONDS_HINT: &str = "; column t looks like milliseconds, but is in s";

/// Said where times make sense as microseconds only.
pub(crate) const MICROSECONDS_HINT: &str = "; column t looks like microseconds, but is in s";

/// What can stand in the column `validity`.
pub const VALIDITIES: [(&str, Validity); 6] = [
    ("valid", Validity::Valid),
    (
        "accelerometer_saturated",
        Validity::Saturated(Saturation::Accelerometer),
    ),
    (
        "gyroscope_saturated",
        Validity::Saturated(Saturation::Gyroscope),
    ),
    ("both_saturated", Validity::Saturated(Saturation::Both)),
    ("stale", Validity::Stale),
    ("invalid", Validity::Invalid),
];

/// What reads columns that are no part of a recording.
pub(super) trait Beside {
    /// Whether a column is one of those.
    fn reads(&self, name: &str) -> bool;

    /// Takes in the header.
    fn header(&mut self, header: &Row, file: &str) -> Result<(), InputError>;

    /// Takes in a row.
    fn row(&mut self, row: &Row) -> Result<(), InputError>;
}

/// Reads nothing beside the recording.
impl Beside for () {
    fn reads(&self, _: &str) -> bool {
        false
    }

    fn header(&mut self, _: &Row, _: &str) -> Result<(), InputError> {
        Ok(())
    }

    fn row(&mut self, _: &Row) -> Result<(), InputError> {
        Ok(())
    }
}

/// Reads a table with a header, and what stands `beside` the columns of a recording.
///
/// # Errors
/// The first thing that is wrong with it, with file, line and column.
pub(super) fn read(
    mut table: Table,
    hints: &Hints,
    beside: &mut impl Beside,
) -> Result<Loaded, InputError> {
    let Some(header) = table.next_row()? else {
        return Err(table.empty());
    };
    let mut columns = Columns::checked(&header, table.file())?;
    beside.header(&header, table.file())?;
    columns.ignored.retain(|name| !beside.reads(name));
    let mut clock: Option<Clock> = None;
    let mut times = Vec::new();
    let mut samples = Vec::new();
    while let Some(row) = table.next_row()? {
        row.expect_columns(columns.count)?;
        if let Some(index) = columns.t {
            let now_us = time_us(&row, index)?;
            let clock = clock.get_or_insert_with(|| Clock::starting_at(now_us));
            times.push(clock.advance_to(now_us, &row, index)?);
        }
        samples.push(columns.sample(&row, &hints.correction)?);
        beside.row(&row)?;
    }
    if samples.is_empty() {
        return Err(table.empty());
    }
    let sample_rate = sample_rate(&times, hints.sample_rate, table.file())?;
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.imu.timestamp = times
            .get(k)
            .copied()
            .unwrap_or_else(|| steady_time(k, sample_rate));
    }
    Ok(Loaded {
        start_us: clock.map_or(0, |clock| clock.start_us),
        notices: columns.notice(table.file()).into_iter().collect(),
        recording: Recording {
            name: table.recording_name().to_owned(),
            sample_rate,
            gravity: hints.gravity.unwrap_or(Gravity::Included),
            load_title: "force (N)".to_owned(),
            samples,
        },
    })
}

/// Whether a row is a header, however badly written: a known name stands in it.
pub(super) fn is_header(row: &Row) -> bool {
    row.cells()
        .flat_map(|cell| cell.split(OTHER_SEPARATORS))
        .any(|name| is_known(&name.to_lowercase()))
}

fn is_known(name: &str) -> bool {
    ["t", "force", "label", "validity"].contains(&name)
        || Axis::ALL.iter().any(|axis| axis.name() == name)
}

/// What a header's names are mistakenly separated by.
const OTHER_SEPARATORS: [char; 4] = [';', '\t', ' ', '|'];

/// Where each known column stands.
#[derive(Default)]
struct Columns {
    count: usize,
    t: Option<usize>,
    axes: [Option<usize>; 6],
    force: Option<usize>,
    label: Option<usize>,
    validity: Option<usize>,
    ignored: Vec<String>,
    duplicate: Option<(usize, String)>,
}

impl Columns {
    /// What a header says; `None` where the line holds numbers and so is no header.
    fn from_header(header: &Row) -> Option<Self> {
        let mut columns = Self::default();
        for (index, name) in header.cells().enumerate() {
            if name.parse::<f64>().is_ok() {
                return None;
            }
            columns.count = index + 1;
            let place = match name {
                "t" => &mut columns.t,
                "force" => &mut columns.force,
                "label" => &mut columns.label,
                "validity" => &mut columns.validity,
                _ => match Axis::ALL.iter().position(|axis| axis.name() == name) {
                    Some(axis) => &mut columns.axes[axis],
                    None => {
                        columns.ignored.push(name.to_owned());
                        continue;
                    }
                },
            };
            if place.replace(index).is_some() {
                columns.duplicate = Some((index, name.to_owned()));
            }
        }
        Some(columns)
    }

    fn checked(header: &Row, file: &str) -> Result<Self, InputError> {
        let columns = Self::from_header(header).unwrap_or_default();
        if let Some((index, name)) = &columns.duplicate {
            return Err(InputError::DuplicateColumn {
                cell: header.cell(*index, name),
            });
        }
        let missing = columns.missing();
        if missing.is_empty() {
            Ok(columns)
        } else {
            Err(InputError::MissingColumns {
                file: file.to_owned(),
                line: header.line,
                columns: missing.join(", "),
                slip: columns.slip(),
            })
        }
    }

    /// The axes that the header does not name.
    fn missing(&self) -> Vec<&'static str> {
        Axis::ALL
            .iter()
            .zip(self.axes)
            .filter(|(_, place)| place.is_none())
            .map(|(axis, _)| axis.name())
            .collect()
    }

    /// What makes known names unknown, where that is so.
    fn slip(&self) -> Option<HeaderSlip> {
        let known = |name: &str| is_known(&name.to_lowercase());
        self.ignored.iter().find_map(|name| {
            let separator = name.chars().find(|c| OTHER_SEPARATORS.contains(c));
            match separator {
                Some(found) => name
                    .split(found)
                    .map(str::trim)
                    .any(known)
                    .then_some(HeaderSlip::Separator(found)),
                None => known(name).then_some(HeaderSlip::UpperCase),
            }
        })
    }

    /// The sentence that names the columns nobody asked for.
    fn notice(&self, file: &str) -> Option<String> {
        let names = self.ignored.join(", ");
        (!self.ignored.is_empty()).then(|| format!("{file}: ignored columns: {names}"))
    }

    /// A row's values; the time is filled in later.
    fn sample(&self, row: &Row, correction: &Correction) -> Result<RecordedSample, InputError> {
        let mut axes = [0.0; 6];
        for ((value, place), axis) in axes.iter_mut().zip(self.axes).zip(Axis::ALL) {
            if let Some(index) = place {
                *value = row.number(index, axis.name())?;
            }
        }
        let optional = |place: Option<usize>, name| match place {
            Some(index) => row.optional(index, name),
            None => Ok(None),
        };
        let force = optional(self.force, "force")?;
        let label = match (self.label, optional(self.label, "label")?) {
            (Some(index), Some(value)) => Some(label(row, index, value)?),
            _ => None,
        };
        let validity = match self.validity {
            Some(index) => validity(row, index)?,
            None => Validity::Valid,
        };
        Ok(RecordedSample {
            imu: imu_sample(Timestamp::default(), axes, validity, correction),
            load: force
                .filter(|force| force.is_finite())
                .map(|force| Load(force as f32)),
            label,
        })
    }
}

/// A label in column `index`: 1 is stable, 0 is not.
pub(super) fn label(row: &Row, index: usize, value: f64) -> Result<Label, InputError> {
    if value == 1.0 {
        Ok(Label::Stable)
    } else if value == 0.0 {
        Ok(Label::NotStable)
    } else {
        Err(InputError::Label {
            cell: row.cell(index, "label"),
            text: row.text(index).to_owned(),
        })
    }
}

/// The validity in column `index`.
fn validity(row: &Row, index: usize) -> Result<Validity, InputError> {
    let text = row.text(index);
    if text.is_empty() {
        return Ok(Validity::Valid);
    }
    VALIDITIES
        .into_iter()
        .find(|(name, _)| *name == text)
        .map(|(_, validity)| validity)
        .ok_or_else(|| InputError::Validity {
            cell: row.cell(index, "validity"),
            text: text.to_owned(),
        })
}

/// The time in column `index`, rounded to a microsecond.
fn time_us(row: &Row, index: usize) -> Result<i64, InputError> {
    let value = row.number(index, "t")?;
    if (-MAX_TIME_S..=MAX_TIME_S).contains(&value) {
        Ok((value * 1.0e6).round() as i64)
    } else {
        Err(InputError::Time {
            cell: row.cell(index, "t"),
            text: row.text(index).to_owned(),
        })
    }
}

/// The file's clock, which may start anywhere but runs forward.
struct Clock {
    start_us: i64,
    newest_us: Option<i64>,
}

impl Clock {
    const fn starting_at(start_us: i64) -> Self {
        Self {
            start_us,
            newest_us: None,
        }
    }

    /// The time of a row since the first one.
    fn advance_to(
        &mut self,
        now_us: i64,
        row: &Row,
        index: usize,
    ) -> Result<Timestamp, InputError> {
        match self.newest_us.replace(now_us) {
            Some(previous_us) if now_us <= previous_us => Err(InputError::TimeOrder {
                cell: row.cell(index, "t"),
                text: row.text(index).to_owned(),
                previous: previous_us as f64 / 1.0e6,
            }),
            _ => Ok(Timestamp::from_micros(now_us.abs_diff(self.start_us))),
        }
    }
}

/// The sample rate in Hz that times and hint agree on.
fn sample_rate(times: &[Timestamp], given: Option<f32>, file: &str) -> Result<f32, InputError> {
    match (measured_rate(times), given) {
        (Some(measured), Some(given)) if !agree(measured, given) => {
            Err(InputError::SampleRateConflict {
                file: file.to_owned(),
                measured,
                given,
                in_milliseconds: agree(1.0e3 * measured, given),
            })
        }
        (_, Some(given)) => Ok(given),
        (Some(measured), None) => Ok(measured as f32),
        (None, None) => Err(InputError::UnknownSampleRate {
            file: file.to_owned(),
        }),
    }
}

fn agree(measured: f64, given: f32) -> bool {
    (f64::from(given) - measured).abs() <= RATE_TOLERANCE * measured
}

/// The rate in Hz that the times between rows tell, gaps left out.
///
/// Rows may stand up to a fraction of a period off their places, as samples do that wait for a
/// sensor with a clock of its own. So the rate is one over the mean time, and what can be known of
/// it ends where the rows' places do: of the rates within that, it is the roundest.
fn measured_rate(times: &[Timestamp]) -> Option<f64> {
    let mut steps: Vec<u64> = times
        .windows(2)
        .filter_map(|pair| pair[1].micros_since(pair[0]))
        .collect();
    if steps.is_empty() {
        return None;
    }
    let all = steps.len();
    let median = *steps.select_nth_unstable(all / 2).1;
    steps.retain(|step| 2 * step.abs_diff(median) <= median);
    let (shortest, longest) = (steps.iter().min()?, steps.iter().max()?);
    let runs = (all - steps.len() + 1) as f64;
    let count = steps.len() as f64;
    let mean = steps.iter().sum::<u64>() as f64 / count;
    let uncertainty = runs * (longest - shortest) as f64 / count;
    Some(roundest(
        1.0e6 / (mean + uncertainty),
        1.0e6 / mean,
        1.0e6 / (mean - uncertainty).max(1.0),
    ))
}

/// `rate`, or the multiple nearest to it of the largest power of ten that has one from `lowest`
/// to `highest`.
fn roundest(lowest: f64, rate: f64, highest: f64) -> f64 {
    [1.0e4, 1.0e3, 1.0e2, 1.0e1, 1.0]
        .into_iter()
        .map(|unit| (rate / unit).round() * unit)
        .find(|round| *round > 0.0 && (lowest..=highest).contains(round))
        .unwrap_or(rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Vec3;
    use std::io::Write;

    fn read_text(text: impl AsRef<[u8]>, hints: &Hints) -> Result<Loaded, InputError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_ref()).unwrap();
        read(Table::open(file.path())?, hints, &mut ())
    }

    fn loaded(text: impl AsRef<[u8]>) -> Loaded {
        read_text(text, &Hints::default()).unwrap()
    }

    #[test]
    fn columns_may_stand_in_any_order() {
        let Loaded {
            recording, notices, ..
        } = loaded("label,wz,wy,wx,az,ay,ax,force,t\n1,6,5,4,3,2,1,7,0\n0,6,5,4,3,2,1,,0.002\n");
        let [first, second] = recording.samples[..] else {
            panic!("two rows");
        };
        assert_eq!(first.imu.specific_force.0, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(first.imu.angular_rate.0, Vec3::new(4.0, 5.0, 6.0));
        assert_eq!(
            (first.load, first.label),
            (Some(Load(7.0)), Some(Label::Stable))
        );
        assert_eq!((second.load, second.label), (None, Some(Label::NotStable)));
        assert_eq!(second.imu.timestamp, Timestamp::from_micros(2000));
        assert_eq!(recording.sample_rate, 500.0);
        assert!(notices.is_empty());
    }

    #[test]
    fn windows_line_ends_and_a_byte_order_mark_change_nothing() {
        let plain = "t,ax,ay,az,wx,wy,wz\n0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n";
        let windows = format!("\u{feff}{}", plain.replace('\n', "\r\n"));
        assert_eq!(
            loaded(windows).recording.samples,
            loaded(plain).recording.samples
        );
    }

    #[test]
    fn line_numbers_are_those_of_an_editor_whatever_the_line_ends() {
        for end in ["\n", "\r\n"] {
            let lines = ["ax,ay,az,wx,wy,wz", "0,0,0,0,0,0", "", "0,0,x,0,0,0"];
            for text in [lines.join(end), lines.join(end) + end] {
                match read_text(text, &Hints::default()) {
                    Err(InputError::NotANumber { cell, .. }) => {
                        assert_eq!((cell.line, cell.column), (4, 3));
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    #[test]
    fn columns_that_mean_nothing_here_are_named_in_one_notice() {
        let notices =
            loaded("t,ax,ay,az,wx,wy,wz,qw,qx\n0,1,2,3,4,5,6,,\n1,1,2,3,4,5,6,,\n").notices;
        assert_eq!(notices.len(), 1);
        assert!(notices[0].ends_with(": ignored columns: qw, qx"));
    }

    #[test]
    fn what_is_not_finite_reaches_the_estimator_which_flags_it() {
        let recording =
            loaded("t,ax,ay,az,wx,wy,wz\n0,nan,inf,-inf,1e300,0,0\n1,0,0,0,0,0,0\n").recording;
        assert_eq!(
            recording.samples[0].imu.checked_validity(),
            Validity::Invalid
        );
    }

    #[test]
    fn the_rate_is_that_of_the_steps_without_gaps() {
        let times = [0, 3_500, 7_000, 90_000, 93_500].map(Timestamp::from_micros);
        let rate = measured_rate(&times).unwrap();
        assert!((rate - 285.714).abs() < 1e-3, "{rate}");
        assert_eq!(measured_rate(&times[..1]), None);
    }

    #[test]
    fn the_clock_may_start_anywhere() {
        for (start, start_us) in [
            ("-0.002", -2000),
            ("0.5", 500_000),
            ("1700000000.123457", 1_700_000_000_123_457),
        ] {
            let second = start.parse::<f64>().unwrap() + 0.004;
            let text = format!("t,ax,ay,az,wx,wy,wz\n{start},1,2,3,4,5,6\n{second},1,2,3,4,5,6\n");
            let Loaded {
                recording,
                start_us: found,
                ..
            } = loaded(text);
            assert_eq!(found, start_us);
            let times = recording
                .samples
                .iter()
                .map(|s| s.imu.timestamp.as_micros());
            assert!(times.eq([0, 4000]));
        }
    }

    #[test]
    fn rows_that_wait_for_a_sensors_edges_have_the_rate_of_their_ticks() {
        for period in [146, 150, 153, 155] {
            for rows in [50, 500, 5_000] {
                let edge = |tick: u64| (tick * 1000).next_multiple_of(period);
                let times: Vec<_> = (0..rows).map(edge).map(Timestamp::from_micros).collect();
                assert_eq!(
                    measured_rate(&times),
                    Some(1000.0),
                    "{period} µs, {rows} rows"
                );
            }
        }
    }

    #[test]
    fn jitter_does_not_bias_the_rate() {
        // Rarely late by a little, made up for by few short steps: the median is 1003 µs.
        let steps = [1003, 1003, 1003, 991].into_iter().cycle().take(4000);
        let times: Vec<_> = steps
            .scan(0, |now, step| {
                *now += step;
                Some(Timestamp::from_micros(*now))
            })
            .collect();
        let rate = measured_rate(&times).unwrap();
        assert!((rate - 1000.0).abs() < 0.01, "{rate}");
    }

    #[test]
    fn a_rate_that_is_no_number_agrees_with_no_times() {
        let times = [0, 10_000, 20_000].map(Timestamp::from_micros);
        assert!(sample_rate(&times, Some(f32::NAN), "x").is_err());
    }

    #[test]
    fn a_validity_is_kept_by_name_and_a_name_nobody_knows_is_an_error() {
        let table = |cell: &str| {
            format!("t,ax,ay,az,wx,wy,wz,validity\n0,1,2,3,4,5,6,{cell}\n1,0,0,0,0,0,0,\n")
        };
        for (name, validity) in VALIDITIES {
            let samples = loaded(table(name)).recording.samples;
            assert_eq!(
                [samples[0].imu.validity, samples[1].imu.validity],
                [validity, Validity::Valid]
            );
        }
        let error = read_text(table("maybe"), &Hints::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.ends_with(", line 2, column 8 (validity): \"maybe\" where valid, accelerometer_saturated, gyroscope_saturated, both_saturated, stale or invalid is expected"),
            "{error}"
        );
    }

    #[test]
    fn without_times_rows_are_spaced_by_the_rate_given() {
        let hints = Hints {
            sample_rate: Some(400.0),
            gravity: Some(Gravity::Removed),
            ..Hints::default()
        };
        let recording = read_text("ax,ay,az,wx,wy,wz\n0,0,0,0,0,0\n0,0,0,0,0,0\n", &hints)
            .unwrap()
            .recording;
        assert_eq!(
            recording.samples[1].imu.timestamp,
            Timestamp::from_micros(2500)
        );
        assert_eq!(recording.gravity, Gravity::Removed);
    }

    #[test]
    fn a_rate_within_one_percent_of_the_times_is_believed() {
        let times = [0, 10_000, 20_000].map(Timestamp::from_micros);
        assert_eq!(sample_rate(&times, Some(100.9), "x").unwrap(), 100.9);
        assert!(sample_rate(&times, Some(101.1), "x").is_err());
    }
}
