//! Keys of a configuration file: meaning, unit, range, preset value and object addresses on a foot. Numbers come
//! from the estimator's table of limits.

use crate::number::shown;
use estimator_core::{Axis, Learnt, Mounting, Parameter, Params, Row, parameter};
use wire::dictionary::{self, Address};

use super::axes::axes_text;
use super::correction::{ACCELEROMETER_BIAS, ACCELEROMETER_SCALE, GYROSCOPE_BIAS, Limits};
use super::notation::Notation;
use super::value::{GRAVITIES, LEARNINGS, METHODS, gyro_timing_text, window_text, word_of};

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
    Gravity,
    /// Mounting of the sensor in the foot.
    Axes,
    Method,
    Learning,
    Window,
    GyroTiming,
    /// Learnt number, by its index.
    Learnt(usize),
    Correction(Limits),
}

/// Example of learnt numbers.
const LEARNT_EXAMPLE: [f32; Learnt::NUMBERS] = [-0.9, 2.4, -4.7, 4.6, 4.6];

/// Returns all keys, in file order.
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
    // The sample rate comes first; numbers without a table precede those with one.
    let rest = numbers.split_off(1);
    let mut all = numbers;
    all.extend([
        key("gravity", Kind::Gravity),
        key("axes", Kind::Axes),
        key("method", Kind::Method),
        key("learning", Kind::Learning),
        key(parameter::WINDOW.name, Kind::Window),
    ]);
    all.extend(rest);
    all.push(key(parameter::GYRO_DELAY.name, Kind::GyroTiming));
    all.extend((0..).zip(Learnt::ROWS).map(|(place, row)| key(row.name, Kind::Learnt(place))));
    for limits in [ACCELEROMETER_BIAS, ACCELEROMETER_SCALE, GYROSCOPE_BIAS] {
        all.push(key(limits.key, Kind::Correction(limits)));
    }
    let of_foot = |path: &str| format!("{OF_FOOT}{path}");
    all.push(key(&of_foot("axes"), Kind::Axes));
    let numbers = Parameter::ALL.into_iter().filter(|number| {
        let name = number.name();
        name.starts_with("decision.") || name.starts_with("load.")
    });
    all.extend(numbers.map(|number| key(&of_foot(number.name()), Kind::Numbers(vec![number]))));
    all
}

/// Returns the keys that a foot can have values of its own for, without the table of the foot.
pub(super) fn keys_of_a_foot() -> Vec<Key> {
    const TABLES: [&str; 6] = ["axes", "learnt", "accelerometer", "gyroscope", "decision", "load"];
    let mut all = keys();
    all.retain(|key| TABLES.contains(&key.path.split('.').next().unwrap_or_default()));
    all
}

/// Beginning of the keys of one foot.
pub(super) const OF_FOOT: &str = "feet.FL.";

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
            Kind::Method => "where the limits of stillness come from",
            Kind::Learning => "whether the foot goes on learning",
            Kind::Correction(limits) => limits.meaning,
            Kind::Numbers(_) | Kind::Window | Kind::GyroTiming | Kind::Learnt(_) => {
                self.row().map_or("", |row| row.about)
            }
        }
    }

    /// Returns the row of the first number in the table of limits; `None` if the key has no number there.
    fn row(&self) -> Option<Row> {
        match &self.kind {
            Kind::Numbers(numbers) => numbers.first().map(|number| number.row()),
            Kind::Window => Some(parameter::WINDOW),
            Kind::GyroTiming => Some(parameter::GYRO_DELAY),
            Kind::Learnt(place) => Learnt::ROWS.get(*place).copied(),
            Kind::Gravity | Kind::Axes | Kind::Method | Kind::Learning | Kind::Correction(_) => {
                None
            }
        }
    }

    /// Returns the unit of the numbers; empty if they have none or the value includes it.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match &self.kind {
            Kind::Window | Kind::GyroTiming => "ms",
            Kind::Correction(limits) => limits.unit,
            _ => self.row().map_or("", |row| row.unit.symbol()),
        }
    }

    /// Returns the accepted values.
    #[must_use]
    pub fn range(&self) -> String {
        let range = self.row().map_or_else(String::new, |row| {
            let notation = Notation::of(row.name);
            let [least, most] = [row.least, row.most].map(|limit| notation.number(limit));
            format!("{least} to {most}")
        });
        let in_words = || range.replace(" to ", "ms\" to \"");
        let of_words = |words: [&str; 2]| format!("\"{}\" or \"{}\"", words[0], words[1]);
        match &self.kind {
            Kind::Numbers(numbers) if numbers[..] == [Parameter::LoadOffThreshold] => {
                format!("{range}, and not above load.on_threshold")
            }
            Kind::Numbers(numbers) if numbers.len() > 1 => {
                let axes: Vec<&str> = numbers.iter().map(|number| axis(*number)).collect();
                format!("{range}; one number, or a table of {}", axes.join(", "))
            }
            Kind::Numbers(_) | Kind::Learnt(_) => range,
            Kind::Gravity => of_words(GRAVITIES.map(|(word, _)| word)),
            Kind::Axes => {
                "three right-handed axes such as \"x,-z,y\", or \"w,x,y,z\" of length 1".to_owned()
            }
            Kind::Method => of_words(METHODS.map(|(word, _)| word)),
            Kind::Learning => of_words(LEARNINGS.map(|(word, _)| word)),
            Kind::Window => format!("\"{}ms\", or \"1samples\" and more", in_words()),
            Kind::GyroTiming => format!("\"period_mean\", or \"{}ms\"", in_words()),
            Kind::Correction(limits) => format!(
                "{} to {}; a table of {}",
                shown(limits.least),
                shown(limits.most),
                limits.axes.join(", ")
            ),
        }
    }

    /// Returns the value in `params`, as written in a file; an example if `params` have none.
    #[must_use]
    pub fn value(&self, params: &Params) -> String {
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
            Kind::Gravity => quoted(word_of(&GRAVITIES, params.gravity)),
            Kind::Axes => quoted(&axes_text(&Mounting::IDENTITY)),
            Kind::Method => quoted(word_of(&METHODS, params.method)),
            Kind::Learning => quoted(word_of(&LEARNINGS, params.learning)),
            Kind::Window => quoted(&window_text(params.window)),
            Kind::GyroTiming => quoted(&gyro_timing_text(params.attitude.gyro_timing)),
            Kind::Learnt(place) => {
                let values = params.learnt.map_or(LEARNT_EXAMPLE, |learnt| learnt.to_array());
                values.get(*place).copied().map_or_else(String::new, shown)
            }
            Kind::Correction(limits) => {
                let each = limits.axes.map(|axis| format!("{axis} = {}", shown(limits.none)));
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

/// Splits the name of a number of one axis into the key of all axes and the axis.
pub(super) fn split_axis(name: &str) -> (&str, Option<&str>) {
    match name.rsplit_once('.') {
        Some((key, axis)) if Axis::ALL.iter().any(|of| of.name() == axis) => (key, Some(axis)),
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
