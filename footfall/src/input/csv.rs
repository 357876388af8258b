//! Tables with a header: `t,ax,ay,az,wx,wy,wz,force,label` in any order, of which the six axes
//! are required.
//!
//! | column | unit | blank cell |
//! |---|---|---|
//! | `t` | s, from 0 on, advancing by at least 1 µs per row | error |
//! | `ax`, `ay`, `az` | m/s², gravity included unless said otherwise | error |
//! | `wx`, `wy`, `wz` | rad/s | error |
//! | `force` | N | no load known |
//! | `label` | 1 stable, 0 not stable | truth not known |
//!
//! Other columns are ignored, and named in a notice. The sample rate is that of the median time
//! between rows, or the one that is given; where there are both they agree within 1 %.

use std::path::Path;

use estimator_core::{Axis, Gravity, Load, Timestamp, Validity};

use super::error::InputError;
use super::table::{Row, Table};
use super::{Hints, Loaded, imu_sample, recording_name, steady_time};
use crate::recording::{Label, RecordedSample, Recording};

/// By how much a given sample rate may differ from that of the times, as a fraction.
const RATE_TOLERANCE: f64 = 0.01;

/// Times must stay below this, s, so that microseconds are exact.
const MAX_TIME_S: f64 = 1.0e12;

/// Reads a table with a header.
///
/// # Errors
/// The first thing that is wrong with it, with file, line and column.
pub fn read(path: &Path, hints: &Hints) -> Result<Loaded, InputError> {
    let mut table = Table::open(path)?;
    let empty = || InputError::Empty {
        file: path.display().to_string(),
    };
    let header = table.next_row()?.ok_or_else(empty)?;
    let columns = Columns::checked(&header, table.file())?;
    let mut times = Vec::new();
    let mut samples = Vec::new();
    while let Some(row) = table.next_row()? {
        row.expect_columns(columns.count)?;
        if let Some(index) = columns.t {
            times.push(time(&row, index, times.last().copied())?);
        }
        samples.push(columns.sample(&row)?);
    }
    if samples.is_empty() {
        return Err(empty());
    }
    let sample_rate = sample_rate(&times, hints.sample_rate, table.file())?;
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.imu.timestamp = times
            .get(k)
            .copied()
            .unwrap_or_else(|| steady_time(k, sample_rate));
    }
    Ok(Loaded {
        notices: columns.notice(table.file()).into_iter().collect(),
        recording: Recording {
            name: recording_name(path),
            sample_rate,
            gravity: hints.gravity.unwrap_or(Gravity::Included),
            load_title: "force (N)".to_owned(),
            samples,
        },
    })
}

/// Where each known column stands.
#[derive(Default)]
pub(super) struct Columns {
    count: usize,
    t: Option<usize>,
    axes: [Option<usize>; 6],
    force: Option<usize>,
    label: Option<usize>,
    ignored: Vec<String>,
    duplicate: Option<(usize, String)>,
}

impl Columns {
    /// What a header says; `None` where the line holds numbers and so is no header.
    pub(super) fn from_header(header: &Row) -> Option<Self> {
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
            })
        }
    }

    /// The axes that the header does not name.
    pub(super) fn missing(&self) -> Vec<&'static str> {
        Axis::ALL
            .iter()
            .zip(self.axes)
            .filter(|(_, place)| place.is_none())
            .map(|(axis, _)| axis.name())
            .collect()
    }

    /// The sentence that names the columns nobody asked for.
    fn notice(&self, file: &str) -> Option<String> {
        let names = self.ignored.join(", ");
        (!self.ignored.is_empty()).then(|| format!("{file}: ignored columns: {names}"))
    }

    /// A row's values; the time is filled in later.
    fn sample(&self, row: &Row) -> Result<RecordedSample, InputError> {
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
        Ok(RecordedSample {
            imu: imu_sample(Timestamp::default(), axes, Validity::Valid),
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
            value,
        })
    }
}

/// The time in column `index`, rounded to a microsecond.
fn time(row: &Row, index: usize, previous: Option<Timestamp>) -> Result<Timestamp, InputError> {
    let value = row.number(index, "t")?;
    let cell = || row.cell(index, "t");
    if !(0.0..=MAX_TIME_S).contains(&value) {
        return Err(InputError::Time {
            cell: cell(),
            value,
        });
    }
    let now = Timestamp::from_micros((value * 1.0e6).round() as u64);
    match previous.filter(|previous| now <= *previous) {
        Some(previous) => Err(InputError::TimeOrder {
            cell: cell(),
            value,
            previous: previous.as_micros() as f64 / 1.0e6,
        }),
        None => Ok(now),
    }
}

/// The sample rate in Hz that times and hint agree on.
fn sample_rate(times: &[Timestamp], given: Option<f32>, file: &str) -> Result<f32, InputError> {
    match (measured_rate(times), given) {
        (Some(measured), Some(given))
            if (f64::from(given) - measured).abs() > RATE_TOLERANCE * measured =>
        {
            Err(InputError::SampleRateConflict {
                file: file.to_owned(),
                measured,
                given,
            })
        }
        (_, Some(given)) => Ok(given),
        (Some(measured), None) => Ok(measured as f32),
        (None, None) => Err(InputError::UnknownSampleRate {
            file: file.to_owned(),
        }),
    }
}

/// One over the median time between rows, Hz: neither a gap nor jitter moves it.
fn measured_rate(times: &[Timestamp]) -> Option<f64> {
    let mut steps: Vec<u64> = times
        .windows(2)
        .filter_map(|pair| pair[1].micros_since(pair[0]))
        .collect();
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| 1.0e6 / *steps.select_nth_unstable(middle).1 as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Vec3;
    use std::io::Write;

    fn read_text(text: impl AsRef<[u8]>, hints: &Hints) -> Result<Loaded, InputError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_ref()).unwrap();
        read(file.path(), hints)
    }

    fn loaded(text: impl AsRef<[u8]>) -> Loaded {
        read_text(text, &Hints::default()).unwrap()
    }

    #[test]
    fn columns_may_stand_in_any_order() {
        let Loaded { recording, notices } =
            loaded("label,wz,wy,wx,az,ay,ax,force,t\n1,6,5,4,3,2,1,7,0\n0,6,5,4,3,2,1,,0.002\n");
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
    fn the_rate_is_that_of_the_median_step() {
        let times = [0, 3_500, 7_000, 90_000, 93_500].map(Timestamp::from_micros);
        let rate = measured_rate(&times).unwrap();
        assert!((rate - 285.714).abs() < 1e-3, "{rate}");
        assert_eq!(measured_rate(&times[..1]), None);
    }

    #[test]
    fn without_times_rows_are_spaced_by_the_rate_given() {
        let hints = Hints {
            sample_rate: Some(400.0),
            gravity: Some(Gravity::Removed),
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
