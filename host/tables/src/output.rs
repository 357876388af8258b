//! Tables of samples and estimates.

use std::borrow::Cow;
use std::io::{self, Write};

use estimator_core::{
    ContactEstimate, Decision, Flag, Load, Quaternion, Timestamp, Validity, Vec3,
};

use samples::space::components;
use samples::{Label, RecordedSample, validity_name};
use stored::About;

/// Header of the table of estimates.
///
/// | columns | meaning | unit |
/// |---|---|---|
/// | `t` | time of the sample on the recording's clock, six decimals | s |
/// | `p_stable` | stable contact: the foot moves as little as in its stances | [0, 1] |
/// | `p_tangential` | no motion along the ground; with half-widths also no turn about up | [0, 1] |
/// | `p_vertical` | no lifting; with half-widths also no tilting | [0, 1] |
/// | `p_ax` … `p_wz` | the foot does not move along or about one axis of the foot | [0, 1] |
/// | `qw` … `qz` | orientation, Hamilton, foot → world | unit quaternion |
/// | `lax`, `lay`, `laz` | linear acceleration, frame of the foot | m/s² |
/// | `bwx`, `bwy`, `bwz` | gyroscope bias, frame of the foot | rad/s |
/// | `sigma_v` | [standard deviation](estimator_core::velocity) of the foot's velocity about zero | m/s |
/// | `state` | name of the [`Phase`](estimator_core::Phase); `unknown` without a load | |
/// | `decision` | the debounced [`Decision`]: 1 stable, 0 not, from the IMU alone | 0 or 1 |
/// | `flags` | names of the [`Flags`](estimator_core::Flags), joined by a vertical bar | |
///
/// An unknown number is blank, such as a number that a recorded contact lacks.
///
/// With half-widths, the first three are the paper's products of probabilities per axis; see
/// [`Probabilities`](estimator_core::Probabilities).
pub const HEADER: &str = "t,p_stable,p_tangential,p_vertical,p_ax,p_ay,p_az,p_wx,p_wy,p_wz,\
     qw,qx,qy,qz,lax,lay,laz,bwx,bwy,bwz,sigma_v,state,decision,flags";

/// Header of a recording, as [`csv`](crate::csv) reads it.
const RECORDING_HEADER: &str = "t,ax,ay,az,wx,wy,wz,force,label,validity";

/// Column before the others in a table of several feet: the name of the foot.
const FOOT: &str = "foot";

/// Names in the rows of a table of estimates or events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowNames {
    /// None: the table is of one foot.
    Absent,
    /// The name of the foot, in a table of the feet of one recording, one after the other.
    Foot,
    /// The name of the recording, followed by the name of the foot if it has one, in a table of several recordings.
    Recording,
}

impl RowNames {
    /// Returns the name of the column of the names, which is the first; `None` if the rows have none.
    #[must_use]
    pub fn column(self) -> Option<&'static str> {
        (self != Self::Absent).then_some(FOOT)
    }

    /// Writes the header of a table with these columns, and with the column of the names.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn write_header(self, columns: &str, to: &mut dyn Write) -> io::Result<()> {
        if let Some(names) = self.column() {
            write!(to, "{names},")?;
        }
        writeln!(to, "{columns}")
    }

    /// Returns the name in the rows of a foot.
    #[must_use]
    pub fn of(self, about: &About) -> Option<String> {
        match self {
            Self::Absent => None,
            Self::Foot => Some(about.foot_or_name().to_owned()),
            Self::Recording => Some(about.title()),
        }
    }
}

/// Writes a row of a table of estimates. Numbers read back as the same f32. `foot` is given if the table has
/// several feet; `start_us` is the time of the recording's clock at timestamp 0, µs.
///
/// # Errors
/// Any error of the writer.
pub fn write_row(
    foot: Option<&str>,
    estimate: &ContactEstimate,
    start_us: i64,
    to: &mut dyn Write,
) -> io::Result<()> {
    write_start(foot, estimate.timestamp, start_us, to)?;
    write_estimate(estimate, to)?;
    writeln!(to)
}

/// A name as a cell, quoted if necessary.
fn quoted(name: &str) -> Cow<'_, str> {
    if name.contains(['"', ',', '\n', '\r']) {
        Cow::Owned(format!("\"{}\"", name.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(name)
    }
}

/// Writes a recording as a `csv` that reads back as the same samples.
///
/// # Errors
/// Any error of the writer.
pub fn write_recording(samples: &[RecordedSample], to: &mut dyn Write) -> io::Result<()> {
    write_recording_header(to)?;
    for sample in samples {
        write_recording_row(sample, 0, to)?;
    }
    Ok(())
}

/// Writes the header of a recording.
///
/// # Errors
/// Any error of the writer.
pub fn write_recording_header(to: &mut dyn Write) -> io::Result<()> {
    writeln!(to, "{RECORDING_HEADER}")
}

/// Writes a row of a recording; `start_us` is the time of its clock at timestamp 0, µs. Numbers read back as the
/// same f32, times as the same microsecond.
///
/// # Errors
/// Any error of the writer.
pub fn write_recording_row(
    sample: &RecordedSample,
    start_us: i64,
    to: &mut dyn Write,
) -> io::Result<()> {
    write_sample(sample, start_us, to)?;
    writeln!(to)
}

/// Writes a recording with its estimates, one per sample: the columns of [`write_recording`], then the columns of
/// [`HEADER`] except its time.
///
/// # Errors
/// Any error of the writer.
pub fn write_samples(
    samples: &[RecordedSample],
    estimates: &[ContactEstimate],
    to: &mut dyn Write,
) -> io::Result<()> {
    let estimates_header = HEADER.trim_start_matches("t,");
    writeln!(to, "{RECORDING_HEADER},{estimates_header}")?;
    for (sample, estimate) in samples.iter().zip(estimates) {
        write_sample(sample, 0, to)?;
        write_estimate(estimate, to)?;
        writeln!(to)?;
    }
    Ok(())
}

/// Writes the columns of a recording.
fn write_sample(sample: &RecordedSample, start_us: i64, to: &mut dyn Write) -> io::Result<()> {
    write_time(sample.imu.timestamp, start_us, to)?;
    for Vec3 { x, y, z } in [sample.imu.specific_force.0, sample.imu.angular_rate.0] {
        write!(to, ",{x},{y},{z}")?;
    }
    match sample.load {
        Some(Load(force)) => write!(to, ",{force}")?,
        None => write!(to, ",")?,
    }
    to.write_all(match sample.label {
        Some(Label::Stable) => b",1,",
        Some(Label::NotStable) => b",0,",
        None => b",,",
    })?;
    match sample.imu.validity {
        // Blank means valid.
        Validity::Valid => Ok(()),
        validity => to.write_all(validity_name(validity).as_bytes()),
    }
}

/// Time on the recording's clock, s; `start_us` is the time of that clock at timestamp 0, µs.
#[must_use]
pub fn seconds(timestamp: Timestamp, start_us: i64) -> f64 {
    on_clock(timestamp, start_us) as f64 / 1.0e6
}

/// Time on the recording's clock, µs. The sum of start and timestamp may exceed 64 bits.
fn on_clock(timestamp: Timestamp, start_us: i64) -> i128 {
    i128::from(timestamp.as_micros()) + i128::from(start_us)
}

/// Writes the start of a row: the foot, if the table has several, and the time.
///
/// # Errors
/// Any error of the writer.
pub fn write_start(
    foot: Option<&str>,
    timestamp: Timestamp,
    start_us: i64,
    to: &mut dyn Write,
) -> io::Result<()> {
    if let Some(foot) = foot {
        write!(to, "{},", quoted(foot))?;
    }
    write_time(timestamp, start_us, to)
}

fn write_time(timestamp: Timestamp, start_us: i64, to: &mut dyn Write) -> io::Result<()> {
    let micros = on_clock(timestamp, start_us);
    let sign = if micros < 0 { "-" } else { "" };
    let size = micros.unsigned_abs();
    write!(to, "{sign}{}.{:06}", size / 1_000_000, size % 1_000_000)
}

/// Numbers of a row of [`HEADER`], without the time.
pub fn numbers(estimate: &ContactEstimate) -> impl Iterator<Item = f32> {
    let p = estimate.probabilities;
    let Quaternion { w, x, y, z } = estimate.orientation;
    [p.stable, p.tangential, p.vertical]
        .into_iter()
        .chain(p.axes.to_array())
        .chain([w, x, y, z])
        .chain(components(estimate.linear_acceleration.0))
        .chain(components(estimate.gyro_bias.0))
        .chain([estimate.velocity_sigma.0])
}

/// Writes a row of [`HEADER`] without the time.
fn write_estimate(estimate: &ContactEstimate, to: &mut dyn Write) -> io::Result<()> {
    for number in numbers(estimate) {
        // The shortest decimals that read back as the same f32.
        if number.is_nan() {
            write!(to, ",")?;
        } else {
            write!(to, ",{number}")?;
        }
    }
    let flags: Vec<_> = estimate.flags.iter().map(Flag::name).collect();
    let decision = u8::from(estimate.decision == Decision::Stable);
    let phase = estimate.phase.name();
    write!(to, ",{phase},{decision},{}", flags.join("|"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{
        AngularRate, Flags, Gravity, ImuSample, LinearAcceleration, PerAxis, Phase, Probabilities,
        Saturation, SpecificForce, VelocitySigma,
    };

    use crate::csv;
    use crate::reader::Table;
    use options::InputOptions;

    fn table(estimate: ContactEstimate) -> String {
        let mut bytes = Vec::new();
        RowNames::Absent.write_header(HEADER, &mut bytes).unwrap();
        write_row(None, &estimate, 0, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    fn cells(estimate: ContactEstimate) -> Vec<String> {
        let table = table(estimate);
        let row = table.lines().nth(1).unwrap();
        row.split(',').map(str::to_owned).collect()
    }

    /// An estimate and a sample whose numbers are all different.
    fn all_different() -> (RecordedSample, ContactEstimate) {
        let imu = ImuSample {
            timestamp: Timestamp::from_micros(1_500_345),
            specific_force: SpecificForce(Vec3::new(1.25, -2.25, 9.75)),
            angular_rate: AngularRate(Vec3::new(0.125, -0.375, 0.625)),
            validity: Validity::Saturated(Saturation::Gyroscope),
        };
        let sample = RecordedSample { imu, load: Some(Load(42.5)), label: Some(Label::Stable) };
        let estimate = ContactEstimate {
            timestamp: imu.timestamp,
            probabilities: Probabilities {
                axes: PerAxis { ax: 0.1, ay: 0.2, az: 0.3, wx: 0.4, wy: 0.5, wz: 0.6 },
                tangential: 0.7,
                vertical: 0.8,
                stable: 0.9,
            },
            orientation: Quaternion { w: 0.91, x: 0.92, y: 0.93, z: 0.94 },
            linear_acceleration: LinearAcceleration(Vec3::new(11.0, 12.0, 13.0)),
            gyro_bias: AngularRate(Vec3::new(0.01, 0.02, 0.03)),
            angular_rate: AngularRate(Vec3::new(21.0, 22.0, 23.0)),
            velocity_sigma: VelocitySigma(0.04),
            decision: Decision::Stable,
            phase: Phase::Stance,
            flags: Flags::NONE.with(Flag::TimeGap),
        };
        (sample, estimate)
    }

    #[test]
    fn estimate_columns_match_their_names() {
        let (_, estimate) = all_different();
        assert_eq!(
            table(estimate),
            "t,p_stable,p_tangential,p_vertical,p_ax,p_ay,p_az,p_wx,p_wy,p_wz,\
         qw,qx,qy,qz,lax,lay,laz,bwx,bwy,bwz,sigma_v,state,decision,flags\n\
         1.500345,0.9,0.7,0.8,0.1,0.2,0.3,0.4,0.5,0.6,\
         0.91,0.92,0.93,0.94,11,12,13,0.01,0.02,0.03,0.04,stance,1,time_gap\n"
        );
    }

    #[test]
    fn sample_columns_match_their_names() {
        let (sample, estimate) = all_different();
        let mut bytes = Vec::new();
        write_samples(&[sample], &[estimate], &mut bytes).unwrap();
        assert_eq!(
            String::from_utf8(bytes).unwrap(),
            "t,ax,ay,az,wx,wy,wz,force,label,validity,\
         p_stable,p_tangential,p_vertical,p_ax,p_ay,p_az,p_wx,p_wy,p_wz,\
         qw,qx,qy,qz,lax,lay,laz,bwx,bwy,bwz,sigma_v,state,decision,flags\n\
         1.500345,1.25,-2.25,9.75,0.125,-0.375,0.625,42.5,1,gyroscope_saturated,\
         0.9,0.7,0.8,0.1,0.2,0.3,0.4,0.5,0.6,\
         0.91,0.92,0.93,0.94,11,12,13,0.01,0.02,0.03,0.04,stance,1,time_gap\n"
        );
        let mut bytes = Vec::new();
        write_recording(&[sample], &mut bytes).unwrap();
        assert_eq!(
            String::from_utf8(bytes).unwrap(),
            "t,ax,ay,az,wx,wy,wz,force,label,validity\n\
         1.500345,1.25,-2.25,9.75,0.125,-0.375,0.625,42.5,1,gyroscope_saturated\n"
        );
    }

    #[test]
    fn time_is_on_the_recordings_clock() {
        for (start_us, timestamp_us, text) in [
            (-2_500_000, 1, "-2.499999"),
            (-2_500_000, 2_000_000, "-0.500000"),
            (-2_500_000, 2_500_000, "0.000000"),
            (1_700_000_000_123_457, 1000, "1700000000.124457"),
        ] {
            let mut bytes = Vec::new();
            write_time(Timestamp::from_micros(timestamp_us), start_us, &mut bytes).unwrap();
            assert_eq!(bytes, text.as_bytes());
        }
    }

    #[test]
    fn numbers_read_back_as_the_same_bits() {
        for number in [1.0 / 3.0, f32::MIN_POSITIVE, 1.0e-45, 0.999_999_94, 0.0] {
            let estimate = ContactEstimate {
                probabilities: Probabilities { stable: number, ..Probabilities::default() },
                ..ContactEstimate::default()
            };
            let read: f32 = cells(estimate)[1].parse().unwrap();
            assert_eq!(read.to_bits(), number.to_bits());
        }
    }

    #[test]
    fn unknown_number_has_a_blank_cell() {
        let estimate = ContactEstimate {
            velocity_sigma: VelocitySigma(f32::NAN),
            ..ContactEstimate::default()
        };
        assert_eq!(cells(estimate)[19..22], ["0", "", "unknown"]);
    }

    #[test]
    fn state_and_flags_are_names() {
        let estimate = ContactEstimate {
            phase: Phase::QuietSwing,
            flags: Flags::NONE.with(Flag::TimeGap).with(Flag::Saturated),
            ..ContactEstimate::default()
        };
        assert_eq!(cells(estimate)[21..], ["quiet_swing", "0", "saturated|time_gap"]);
    }

    #[test]
    fn table_of_samples_reads_back_as_the_recording() {
        let samples = [
            (0, None, None, Validity::Saturated(Saturation::Gyroscope)),
            (1, Some(Load(0.1)), Some(Label::Stable), Validity::Valid),
        ];
        let samples = samples.map(|(k, load, label, validity)| RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(k * 1000),
                specific_force: SpecificForce(Vec3::new(1.0 / 3.0, -0.1, 9.81)),
                validity,
                ..ImuSample::default()
            },
            load,
            label,
        });
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("walk.csv");
        let estimates = [ContactEstimate::default(); 2];
        let mut bytes = Vec::new();
        write_samples(&samples, &estimates, &mut bytes).unwrap();
        std::fs::write(&path, bytes).unwrap();
        let mut feet = csv::read(Table::open(&path).unwrap(), &InputOptions::default()).unwrap();
        let recording = feet.remove(0).into_loaded().unwrap().recording;
        assert_eq!(recording.samples, samples);
        assert_eq!(recording.gravity, Gravity::Included);
    }
}
