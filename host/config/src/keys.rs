//! Keys of a configuration file: meaning, unit, range, preset value and object addresses on a foot. Also the file
//! that lists all keys. Numbers come from the estimator's table of limits.

use estimator_core::any::{AnyParams, Method};
use estimator_core::mounting::Mounting;
use estimator_core::parameter::{self, Parameter, Row};
use estimator_core::{Axis, Learnt, Stream, Vec3};
use wire::dictionary::{self, Address};

use crate::Preset;
use crate::value::{LEARNINGS, METHODS, Notation, gyro_timing_text, window_text};
use options::words::{GRAVITIES, word_of};
use options::{Correction, Format};
use samples::mounting::axes_text;
use samples::number::shown;

/// A key of a configuration file.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Name, including the tables it is in.
    pub path: String,
    pub(super) kind: Kind,
}

/// Kind of value behind a key.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// A number, or one for each of a sensor's axes.
    Numbers(Vec<Parameter>),
    SampleRate,
    Gravity,
    /// Mounting of the sensor in the foot.
    Axes,
    Method,
    Learning,
    Window,
    GyroTiming,
    /// Learnt number, by its index.
    Learnt(usize),
    /// Version of the learnt numbers.
    LearntVersion,
    /// CRC of the learnt numbers and their version.
    LearntCrc,
    Correction(CorrectionKey),
}

/// Beginning of the keys of one foot.
pub(super) const OF_FOOT: &str = "feet.FL.";

/// Returns all keys, in file order. The keys of half-widths are last.
#[must_use]
pub fn keys() -> Vec<Key> {
    let key = |path: &str, kind| Key { path: path.to_owned(), kind };
    let mut numbers: Vec<Key> = Vec::new();
    for number in Parameter::ALL {
        let (path, _) = split_axis(number.name());
        match numbers.last_mut() {
            Some(Key { path: last, kind: Kind::Numbers(axes) }) if *last == path => {
                axes.push(number);
            }
            _ => numbers.push(key(path, Kind::Numbers(vec![number]))),
        }
    }
    let (of_half_widths, of_both): (Vec<Key>, Vec<Key>) =
        numbers.into_iter().partition(|key| is_of_half_widths(&key.path));
    let mut all = vec![
        key(parameter::SAMPLE_RATE.name, Kind::SampleRate),
        key("gravity", Kind::Gravity),
        key("axes", Kind::Axes),
        key("method", Kind::Method),
        key("learning", Kind::Learning),
    ];
    all.extend(of_both);
    all.push(key(parameter::GYRO_DELAY.name, Kind::GyroTiming));
    all.extend((0..).zip(Learnt::ROWS).map(|(index, row)| key(row.name, Kind::Learnt(index))));
    all.push(key("learnt.version", Kind::LearntVersion));
    all.push(key("learnt.crc", Kind::LearntCrc));
    for correction in [ACCELEROMETER_BIAS, ACCELEROMETER_SCALE, GYROSCOPE_BIAS] {
        all.push(key(correction.path, Kind::Correction(correction)));
    }
    let of_foot = |path: &str| format!("{OF_FOOT}{path}");
    all.push(key(&of_foot("axes"), Kind::Axes));
    let numbers = Parameter::ALL.into_iter().filter(|number| {
        let name = number.name();
        ["decision.", "load.", "velocity."].iter().any(|table| name.starts_with(table))
    });
    all.extend(numbers.map(|number| key(&of_foot(number.name()), Kind::Numbers(vec![number]))));
    all.push(key(parameter::WINDOW.name, Kind::Window));
    all.extend(of_half_widths);
    all
}

/// Returns whether a key belongs to the method with half-widths.
fn is_of_half_widths(path: &str) -> bool {
    let table = path.split('.').next().unwrap_or_default();
    ["window", "bandwidth", "half_width"].contains(&table)
}

/// Returns the keys that the table of a single foot may contain, without the name of that table.
pub(super) fn keys_of_a_foot() -> Vec<Key> {
    const TABLES: [&str; 7] =
        ["axes", "learnt", "accelerometer", "gyroscope", "decision", "load", "velocity"];
    let mut all = keys();
    all.retain(|key| TABLES.contains(&key.path.split('.').next().unwrap_or_default()));
    all
}

impl Key {
    /// Returns the meaning, as a phrase.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        match &self.kind {
            Kind::Gravity => "whether the accelerations contain gravity",
            Kind::Axes => {
                "how the sensor lies in the foot: its axes along the foot's x, y and z, which is up, or a \
                 quaternion from its frame to the foot's"
            }
            Kind::Method => "source of the limits of stillness",
            Kind::Learning => "whether the foot continues to learn",
            Kind::LearntVersion => "version of the learnt numbers, which determines their meaning",
            Kind::LearntCrc => {
                "CRC-32 of the learnt numbers and their version; without it they are not checked"
            }
            Kind::Correction(key) => key.meaning,
            Kind::Numbers(_)
            | Kind::SampleRate
            | Kind::Window
            | Kind::GyroTiming
            | Kind::Learnt(_) => self.row().map_or("", |row| row.about),
        }
    }

    /// Returns the row of the first number in the table of limits; `None` if the key has no number there.
    fn row(&self) -> Option<Row> {
        match &self.kind {
            Kind::Numbers(numbers) => numbers.first().map(|number| number.row()),
            Kind::SampleRate => Some(parameter::SAMPLE_RATE),
            Kind::Window => Some(parameter::WINDOW),
            Kind::GyroTiming => Some(parameter::GYRO_DELAY),
            Kind::Learnt(index) => Learnt::ROWS.get(*index).copied(),
            Kind::Gravity
            | Kind::Axes
            | Kind::Method
            | Kind::Learning
            | Kind::LearntVersion
            | Kind::LearntCrc
            | Kind::Correction(_) => None,
        }
    }

    /// Returns the unit of the numbers; empty if they have none or the value includes it.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match &self.kind {
            Kind::Window | Kind::GyroTiming => "ms",
            Kind::Correction(key) => key.unit,
            _ => self.row().map_or("", |row| row.unit.symbol()),
        }
    }

    /// Returns the least and the most number, as they are written without their unit; `None` without limits.
    fn limits(&self) -> Option<[String; 2]> {
        match &self.kind {
            Kind::LearntCrc => Some([u32::MIN, u32::MAX].map(|limit| limit.to_string())),
            Kind::Correction(key) => Some([key.least, key.most].map(shown)),
            _ => self.row().map(|row| {
                let notation = Notation::of(row.name);
                [row.least, row.most].map(|limit| notation.number(limit))
            }),
        }
    }

    /// Returns the accepted values.
    #[must_use]
    pub fn range(&self) -> String {
        let [least, most] = self.limits().unwrap_or_default();
        let of_words = |words: [&str; 2]| format!("\"{}\" or \"{}\"", words[0], words[1]);
        match &self.kind {
            Kind::Numbers(numbers) if numbers[..] == [Parameter::LoadOffThreshold] => {
                format!("{least} to {most}, and not above load.on_threshold")
            }
            Kind::Numbers(numbers) if numbers.len() > 1 => {
                let axes: Vec<&str> = numbers.iter().map(|number| axis(*number)).collect();
                format!("{least} to {most}; one number, or a table of {}", axes.join(", "))
            }
            Kind::Numbers(_) | Kind::SampleRate | Kind::Learnt(_) | Kind::LearntCrc => {
                format!("{least} to {most}")
            }
            Kind::LearntVersion => Learnt::VERSION.to_string(),
            Kind::Gravity => of_words(GRAVITIES.map(|(word, _)| word)),
            Kind::Axes => {
                "three right-handed axes such as \"x,-z,y\", or \"w,x,y,z\" of length 1".to_owned()
            }
            Kind::Method => of_words(METHODS.map(|(word, _)| word)),
            Kind::Learning => of_words(LEARNINGS.map(|(word, _)| word)),
            Kind::Window => format!("\"{least}ms\" to \"{most}ms\", or \"1samples\" and more"),
            Kind::GyroTiming => format!("\"period_mean\", or \"{least}ms\" to \"{most}ms\""),
            Kind::Correction(key) => {
                format!("{least} to {most}; a table of {}", key.axes.join(", "))
            }
        }
    }

    /// Returns the value in `params` or of `stream`, as written in a file; an example if they have none.
    #[must_use]
    pub fn value(&self, params: &AnyParams, stream: Stream) -> String {
        match &self.kind {
            Kind::Numbers(numbers) => {
                let values: Vec<f32> = numbers.iter().map(|number| number.get(params)).collect();
                match &values[..] {
                    [first, others @ ..] if others.iter().all(|other| other == first) => {
                        shown(*first)
                    }
                    _ => {
                        let each = numbers.iter().zip(&values);
                        let each: Vec<String> = each
                            .map(|(number, value)| format!("{} = {}", axis(*number), shown(*value)))
                            .collect();
                        format!("{{ {} }}", each.join(", "))
                    }
                }
            }
            Kind::SampleRate => shown(stream.sample_rate()),
            Kind::Gravity => quoted(word_of(&GRAVITIES, stream.gravity())),
            Kind::Axes => quoted(&axes_text(&Mounting::IDENTITY)),
            Kind::Method => quoted(word_of(&METHODS, params.method)),
            Kind::Learning => quoted(word_of(&LEARNINGS, params.params.learning)),
            Kind::Window => quoted(&window_text(params.half_widths.window)),
            Kind::GyroTiming => quoted(&gyro_timing_text(params.params.attitude.gyro_timing)),
            Kind::Learnt(index) => {
                let values = learnt_or_example(params).to_array();
                values.get(*index).copied().map_or_else(String::new, shown)
            }
            Kind::LearntVersion => Learnt::VERSION.to_string(),
            Kind::LearntCrc => learnt_or_example(params).crc().to_string(),
            Kind::Correction(key) => {
                let each = key.axes.map(|axis| format!("{axis} = {}", shown(key.neutral)));
                format!("{{ {} }}", each.join(", "))
            }
        }
    }

    /// Returns the path of the same key for all feet.
    fn of_all_feet(&self) -> &str {
        self.path.strip_prefix(OF_FOOT).unwrap_or(&self.path)
    }

    /// Returns the object addresses on a foot; empty if a foot has none.
    #[must_use]
    pub fn objects(&self) -> Vec<Address> {
        dictionary::settings()
            .filter(|(_, entry)| split_axis(entry.key.as_str()).0 == self.of_all_feet())
            .map(|(address, _)| address)
            .collect()
    }
}

/// Example of learnt numbers.
const LEARNT_EXAMPLE: [f32; Learnt::NUMBERS] = [-0.9, 2.4, -4.7, 4.6, 4.6];

/// Returns the learnt numbers of `params`, or the example if they have none.
fn learnt_or_example(params: &AnyParams) -> Learnt {
    params.params.learnt.unwrap_or(Learnt::from_array(LEARNT_EXAMPLE))
}

/// Splits the name of a number of one axis into the key of all axes and the axis.
pub(super) fn split_axis(name: &str) -> (&str, Option<&str>) {
    match name.rsplit_once('.') {
        Some((key, axis)) if Axis::ALL.iter().any(|known| known.name() == axis) => {
            (key, Some(axis))
        }
        _ => (name, None),
    }
}

/// Returns the axis of a number; empty if it has none.
pub(super) fn axis(number: Parameter) -> &'static str {
    split_axis(number.name()).1.unwrap_or_default()
}

fn quoted(word: &str) -> String {
    format!("\"{word}\"")
}

/// Key that corrects an error of the recording's sensor, with a number for each of three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct CorrectionKey {
    pub path: &'static str,
    /// The numbers that it sets in a correction.
    pub numbers: fn(&mut Correction) -> &mut Vec3,
    pub axes: [&'static str; 3],
    pub unit: &'static str,
    pub least: f32,
    pub most: f32,
    /// Value that corrects nothing.
    pub neutral: f32,
    pub meaning: &'static str,
}

pub(super) const ACCELEROMETER_BIAS: CorrectionKey = CorrectionKey {
    path: "accelerometer.bias_m_s2",
    numbers: |correction| &mut correction.accelerometer.bias,
    axes: ["ax", "ay", "az"],
    unit: "m/s²",
    least: -5.0,
    most: 5.0,
    neutral: 0.0,
    meaning: "reading of the recording's accelerometer in free fall",
};

pub(super) const ACCELEROMETER_SCALE: CorrectionKey = CorrectionKey {
    path: "accelerometer.scale",
    numbers: |correction| &mut correction.accelerometer.scale,
    axes: ["ax", "ay", "az"],
    unit: "",
    least: 0.5,
    most: 2.0,
    neutral: 1.0,
    meaning: "factor of its readings, applied after the bias is subtracted",
};

pub(super) const GYROSCOPE_BIAS: CorrectionKey = CorrectionKey {
    path: "gyroscope.bias_rad_s",
    numbers: |correction| &mut correction.gyroscope_bias,
    axes: ["wx", "wy", "wz"],
    unit: "rad/s",
    least: -1.0,
    most: 1.0,
    neutral: 0.0,
    meaning: "reading of the recording's gyroscope at rest",
};

impl PartialEq for CorrectionKey {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl CorrectionKey {
    /// Checks the value of an axis; the error is a sentence with the range.
    pub(super) fn checked(&self, axis: &str, value: f32) -> Result<f32, String> {
        if (self.least..=self.most).contains(&value) {
            return Ok(value);
        }
        let [is, low, high] = [value, self.least, self.most].map(shown);
        Err(format!("{axis} is {is}, allowed is {low} to {high}"))
    }
}

/// Returns a file in which every key is commented out, with its preset value, meaning, unit and range. Each line is
/// valid without the header of a table.
#[must_use]
pub fn example(preset: Preset) -> String {
    let (params, stream) = (preset.params(Format::Csv), preset.stream(Format::Csv));
    let mut text = String::new();
    for key in keys() {
        text += &format!("\n# {}\n", key.meaning());
        text += &format!("# {}\n", facts(&key, &params));
        text += &format!("#{} = {}\n", key.path, key.value(&params, stream));
    }
    text
}

/// Returns unit, range, object addresses, and a note.
fn facts(key: &Key, params: &AnyParams) -> String {
    let shown_address = |address: &Address| format!("0x{:04X}:{}", address.index, address.subindex);
    let object = match &key.objects()[..] {
        [] => String::new(),
        [only] => format!("on a foot {}", shown_address(only)),
        [first, .., last] => {
            format!("on a foot {} to {}", shown_address(first), shown_address(last))
        }
    };
    let facts = [key.unit(), &key.range(), &object, note(key, params)];
    let facts: Vec<&str> = facts.into_iter().filter(|fact| !fact.is_empty()).collect();
    facts.join("; ")
}

/// Returns a note on a key without effect for these parameters, or on its value; empty without one.
fn note(key: &Key, params: &AnyParams) -> &'static str {
    if is_of_half_widths(&key.path) && params.method == Method::SelfCalibrating {
        return "with method = \"half_widths\" only, else refused";
    }
    let (table, _) = key.path.split_once('.').unwrap_or((&key.path, ""));
    match table {
        "learnt" => "an example, default: a cold start; a calibration writes all of [learnt]",
        "sample_rate_hz" => "default: that of the recording's times",
        "gravity" => "default: that of the recording's format",
        "feet" => {
            "of the foot FL only; allowed are axes, decision, load, velocity, learnt, accelerometer and gyroscope"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    use estimator_core::{AngularRate, SpecificForce, Vec3};

    use crate::file::Overrides;

    fn corrected(text: &str) -> Result<[f32; 6], String> {
        let overrides = Overrides::parse(text, "robot.toml").map_err(|error| error.to_string())?;
        let correction = overrides.correction();
        let force = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let rate = AngularRate(Vec3::new(4.0, 5.0, 6.0));
        let (SpecificForce(f), AngularRate(w)) = correction.apply(force, rate);
        Ok([f.x, f.y, f.z, w.x, w.y, w.z])
    }

    #[test]
    fn missing_keys_correct_nothing() {
        assert_eq!(corrected(""), Ok([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    }

    #[test]
    fn the_bias_is_taken_off_before_the_scale_is_applied() {
        let text = "[accelerometer]\nbias_m_s2 = { ax = 0.5, az = -1 }\nscale = { ax = 2, ay = 0.5 }\n\
                [gyroscope]\nbias_rad_s = { wx = 0.25, wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, 1.0, 4.0, 3.75, 5.0, 6.5]));
    }

    #[test]
    fn sensor_errors_are_corrected_before_axes_are_turned() {
        let text = "axes = 'x,-z,y'\n[accelerometer]\nbias_m_s2 = { az = -1 }\nscale = { ay = 0.5 }\n\
                [gyroscope]\nbias_rad_s = { wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, -4.0, 1.0, 4.0, -6.5, 5.0]));
    }

    #[test]
    fn correction_out_of_range_is_rejected_by_key() {
        for (text, refusal) in [
            (
                "accelerometer.bias_m_s2 = { ay = 9.81 }",
                "robot.toml, line 1, column 34, key accelerometer.bias_m_s2: ay is 9.81, allowed is -5 to 5",
            ),
            (
                "accelerometer.scale = { az = 9.81 }",
                "robot.toml, line 1, column 30, key accelerometer.scale: az is 9.81, allowed is 0.5 to 2",
            ),
            (
                "gyroscope.bias_rad_s = { wy = nan }",
                "robot.toml, line 1, column 31, key gyroscope.bias_rad_s: wy is NaN, allowed is -1 to 1",
            ),
        ] {
            assert_eq!(corrected(text), Err(refusal.to_owned()));
        }
    }

    const PRESETS: [Preset; 2] = [Preset::Default, Preset::Paper];

    /// Returns the keys of an example with their values, without the `#`.
    fn set(text: &str) -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.strip_prefix('#'));
        lines
            .filter(|line| line.contains(" = ") && !line.starts_with(' '))
            .map(str::to_owned)
            .collect()
    }

    #[test]
    fn the_example_changes_nothing() {
        for preset in PRESETS {
            let overrides = Overrides::parse(&example(preset), "x.toml").unwrap();
            assert_eq!(overrides, Overrides::default());
        }
    }

    #[test]
    fn each_example_line_parses_to_the_preset_value() {
        for preset in PRESETS {
            let lines = set(&example(preset));
            assert_eq!(lines.len(), keys().len());
            let params = preset.params(Format::Csv);
            for line in &lines {
                // Learnt values are valid only together, and no preset has any.
                if line.starts_with("learnt.") {
                    continue;
                }
                let overrides = Overrides::parse(line, "x.toml").expect(line);
                assert_ne!(overrides, Overrides::default(), "{line}");
                let mut with = params;
                overrides.apply(&mut with);
                assert_eq!(with, params, "{line}");
                assert_eq!(overrides.correction(), Correction::NONE);
            }
        }
    }

    #[test]
    fn uncommented_example_is_valid() {
        for preset in PRESETS {
            let overrides = Overrides::parse(&set(&example(preset)).join("\n"), "x.toml").unwrap();
            let mut params = preset.params(Format::Csv);
            overrides.apply(&mut params);
            assert_eq!(samples::estimate::check(&params, Stream::KILOHERTZ), Ok(()));
            assert!(params.params.learnt.is_some());
        }
    }

    #[test]
    fn example_lists_every_key() {
        let tops: BTreeSet<String> = keys()
            .iter()
            .map(|key| key.path.split('.').next().unwrap_or_default().to_owned())
            .collect();
        // The reader lists the known keys.
        let error = Overrides::parse("zzz = 1", "x.toml").unwrap_err().to_string();
        let (_, expected) = error.split_once("expected one of ").expect("a list");
        let expected = expected.split(';').next().unwrap_or_default();
        let expected: BTreeSet<String> =
            expected.split(", ").map(|key| key.trim_matches('`').to_owned()).collect();
        assert_eq!(tops, expected);
        // Every key has a meaning and a range.
        for key in keys() {
            assert!(!key.meaning().is_empty(), "{}", key.path);
            assert!(!key.range().is_empty(), "{}", key.path);
        }
    }
}
