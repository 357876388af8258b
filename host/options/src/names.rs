//! Column names of an IMU in tables of other origin, and their detection in a header.
//!
//! | source | accelerations | angular rates | time |
//! |---|---|---|---|
//! | `sensor_msgs/Imu` in `PlotJuggler`'s CSV | `/imu/linear_acceleration/x` | `/imu/angular_velocity/x` | `__time` |
//! | the same by `rostopic echo -p` (ROS 1) | `field.linear_acceleration.x` | `field.angular_velocity.x` | `%time`, ns |
//! | `LowState` of `unitree_go` (Go2) | `imu_state.accelerometer[0]` | `imu_state.gyroscope[0]` | as in the logger |
//! | `LowState` of `unitree_legged_msgs` (A1, Go1) | `imu.accelerometer[0]` | `imu.gyroscope[0]` | as in the logger |
//! | `sensor_combined` of PX4 by `ulog2csv` | `accelerometer_m_s2[0]` | `gyro_rad[0]` | `timestamp`, µs |
//! | loggers for Unitree robots | `imu_acc_x`, `accel_x` | `imu_gyro_x`, `gyro_x` | `time`, `timestamp` |
//!
//! Sources: `sensor_msgs/msg/Imu.msg` of ROS; `PlotJuggler`'s CSV publisher; `IMUState.msg` of
//! <https://github.com/unitreerobotics/unitree_ros2> and `IMU.msg` of
//! <https://github.com/unitreerobotics/unitree_ros_to_real>; `SensorCombined.msg` of <https://github.com/PX4/PX4-Autopilot>.
//! All of them are in m/s² and rad/s.

use crate::mapping::Mapping;
use crate::units::TimeUnit;

/// Names of accelerations without the axis, best first.
const ACCELERATION: [&str; 7] = [
    "linear.acceleration",
    "linearacceleration",
    "accelerometer",
    "accelerometer.m.s2",
    "accel",
    "acc",
    "acceleration",
];

/// Names of angular rates without the axis, best first.
const RATE: [&str; 9] = [
    "angular.velocity",
    "angularvelocity",
    "gyroscope",
    "gyro",
    "gyro.rad",
    "gyr",
    "ang.vel",
    "omega",
    // `gx` next to `ax`, as printed by sketches for an MPU-6050.
    "g",
];

/// Names of times, best first, with their unit if it is part of the name.
const TIME: [(&str, Option<TimeUnit>); 18] = [
    ("__time", Some(TimeUnit::Seconds)),
    ("%time", Some(TimeUnit::Nanoseconds)),
    ("timestamp", None),
    ("time", None),
    ("t", None),
    ("time_s", Some(TimeUnit::Seconds)),
    ("timestamp_s", Some(TimeUnit::Seconds)),
    ("t_s", Some(TimeUnit::Seconds)),
    ("time_ms", Some(TimeUnit::Milliseconds)),
    ("timestamp_ms", Some(TimeUnit::Milliseconds)),
    ("t_ms", Some(TimeUnit::Milliseconds)),
    ("time_us", Some(TimeUnit::Microseconds)),
    ("timestamp_us", Some(TimeUnit::Microseconds)),
    ("t_us", Some(TimeUnit::Microseconds)),
    ("time_ns", Some(TimeUnit::Nanoseconds)),
    ("timestamp_ns", Some(TimeUnit::Nanoseconds)),
    ("t_ns", Some(TimeUnit::Nanoseconds)),
    ("stamp", None),
];

/// Names of the load on a foot, best first. Their unit is N if the name has any.
const LOAD: [&str; 6] = ["force", "contact.force", "foot.force", "force.z", "fz", "grf.z"];

/// The two parts of a `builtin_interfaces/Time`.
const STAMP: [&str; 2] = ["stamp.sec", "stamp.nanosec"];

/// The three axes of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triple {
    /// The accelerometer.
    Acceleration,
    /// The gyroscope.
    Rate,
}

impl Triple {
    /// Our names of the axes.
    pub const fn ours(self) -> [&'static str; 3] {
        match self {
            Self::Acceleration => ["ax", "ay", "az"],
            Self::Rate => ["wx", "wy", "wz"],
        }
    }

    /// Positions of our own names.
    pub fn own(self, names: &[String]) -> Option<[usize; 3]> {
        let at = |axis: &str| names.iter().position(|name| name == axis);
        let [x, y, z] = self.ours().map(at);
        Some([x?, y?, z?])
    }

    const fn theirs(self) -> &'static [&'static str] {
        match self {
            Self::Acceleration => &ACCELERATION,
            Self::Rate => &RATE,
        }
    }
}

/// Position of the three axes of a sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// Not in the header.
    Nowhere,
    /// At these indices.
    At([usize; 3]),
    /// At the indices of several such triples.
    Several(Vec<[usize; 3]>),
}

/// Finds the three axes of a sensor in a header.
pub fn find(triple: Triple, names: &[String]) -> Found {
    let normal: Vec<String> = names.iter().map(|name| normal(name)).collect();
    for sensor in triple.theirs() {
        let triples: Vec<_> = triples(sensor, &normal).collect();
        match triples[..] {
            [] => {}
            [only] => return Found::At(only),
            _ => return Found::Several(triples),
        }
    }
    Found::Nowhere
}

/// As [`find`], also with units after the names.
pub fn find_with_units(triple: Triple, names: &[String]) -> Found {
    match find(triple, names) {
        Found::Nowhere => {
            let bare = without_units(names);
            triple.own(&bare).map_or_else(|| find(triple, &bare), Found::At)
        }
        found => found,
    }
}

/// Removes the units after the names.
pub fn without_units(names: &[String]) -> Vec<String> {
    let bare = names.iter().map(|name| split_unit(name).0.to_owned());
    bare.collect()
}

/// Returns whether the cells of a comment are a header.
pub fn is_header<'a>(cells: impl IntoIterator<Item = &'a str>) -> bool {
    let names: Vec<String> = cells.into_iter().map(str::to_owned).collect();
    let mut triples = [Triple::Acceleration, Triple::Rate].into_iter();
    triples.all(|triple| find_with_units(triple, &names) != Found::Nowhere)
}

/// Positions of the three axes of a sensor of this name, once for each sensor.
fn triples<'a>(sensor: &'a str, names: &'a [String]) -> impl Iterator<Item = [usize; 3]> + 'a {
    let endings = [["x", "y", "z"], ["0", "1", "2"]];
    names.iter().enumerate().filter_map(move |(x, name)| {
        endings.into_iter().find_map(|[first, second, third]| {
            let stem = name.strip_suffix(first)?;
            let bare = stem.strip_suffix('.').unwrap_or(stem);
            let before = bare.strip_suffix(sensor)?;
            if !(before.is_empty() || before.ends_with('.')) {
                return None;
            }
            let at = |axis: &str| {
                let wanted = format!("{stem}{axis}");
                names.iter().position(|name| *name == wanted)
            };
            Some([x, at(second)?, at(third)?])
        })
    })
}

/// Position of the time in a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundTime {
    /// In one column, with its unit if the name defines it.
    Column(usize, Option<TimeUnit>),
    /// Seconds in one column and nanoseconds in another.
    Stamp(usize, usize),
}

/// Finds the time in a header.
pub fn find_time(names: &[String]) -> Option<FoundTime> {
    let index_of = |wanted: &dyn Fn(&str) -> bool| {
        let mut at = (0..names.len()).filter(|index| wanted(&names[*index]));
        at.next().filter(|_| at.next().is_none())
    };
    for (name, unit) in TIME {
        if let Some(index) = index_of(&|given| given.eq_ignore_ascii_case(name)) {
            return Some(FoundTime::Column(index, unit));
        }
    }
    let [seconds, nanoseconds] = STAMP.map(|part| index_of(&|given| ends_with(given, part)));
    if let (Some(seconds), Some(nanoseconds)) = (seconds, nanoseconds) {
        return Some(FoundTime::Stamp(seconds, nanoseconds));
    }
    let stamp = index_of(&|given| ends_with(given, "header.stamp"))?;
    Some(FoundTime::Column(stamp, None))
}

/// Finds the load of the foot in a header: the only column with the best of the known names.
pub fn find_load(names: &[String]) -> Option<usize> {
    let in_newtons = |name: &String| match split_unit(name) {
        (name, None | Some("N")) => Some(normal(name)),
        _ => None,
    };
    let names: Vec<_> = names.iter().map(in_newtons).collect();
    let of_name = |wanted: &&&str| names.iter().flatten().any(|name| name == **wanted);
    let best = LOAD.iter().find(of_name)?;
    let mut at = names.iter().enumerate().filter(|(_, name)| name.as_deref() == Some(*best));
    at.next().filter(|_| at.next().is_none()).map(|(index, _)| index)
}

/// Names of columns that may name the foot of each row, best first.
const FEET: [&str; 29] = [
    "foot",
    "leg",
    "limb",
    "foot.name",
    "leg.name",
    "foot.id",
    "leg.id",
    "side",
    "frame.id",
    "imu.id",
    "imu.name",
    "sensor.id",
    "sensor.name",
    "sensor",
    "device.id",
    "frame",
    "link",
    "imu",
    "device",
    "board",
    "node",
    "location",
    "position",
    "segment",
    "topic",
    "source",
    "channel",
    "name",
    "id",
];

/// Finds the columns that may name the foot of each row, best first. A name that several columns have tells nothing.
#[must_use]
pub fn find_feet(names: &[String]) -> Vec<usize> {
    let mut found = Vec::new();
    for wanted in FEET {
        let mut at = (0..names.len()).filter(|index| ends_with(&names[*index], wanted));
        if let (Some(only), None) = (at.next(), at.next())
            && !found.contains(&only)
        {
            found.push(only);
        }
    }
    found
}

/// Positions of the names that are one of these words, or end in it after a separator.
pub fn position(wanted: &str, names: &[String]) -> Vec<usize> {
    let exact = (0..names.len()).filter(|index| names[*index] == wanted);
    let exact: Vec<usize> = exact.collect();
    if !exact.is_empty() {
        return exact;
    }
    let ending = normal(wanted);
    (0..names.len())
        .filter(|index| !ending.is_empty() && ends_with(&names[*index], &ending))
        .collect()
}

fn ends_with(name: &str, ending: &str) -> bool {
    let name = normal(name);
    name.strip_suffix(ending).is_some_and(|before| before.is_empty() || before.ends_with('.'))
}

/// Splits a name into the name and the unit in brackets at its end: `acc_x [g]`.
pub fn split_unit(name: &str) -> (&str, Option<&str>) {
    let brackets = [('[', ']'), ('(', ')'), ('<', '>')];
    let split = brackets.into_iter().find_map(|(open, close)| {
        let (before, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
        let unit = unit.trim();
        // A number in brackets is an index, not a unit.
        let is_unit = unit.chars().any(|c| c.is_alphabetic() || c == '°');
        is_unit.then(|| (before.trim_end(), Some(unit)))
    });
    split.filter(|(name, _)| !name.is_empty()).unwrap_or((name, None))
}

/// Name in lower case, its parts separated by dots: `/imu/acc[0]` becomes `imu.acc.0`.
fn normal(name: &str) -> String {
    let lower = name.to_lowercase();
    let parts = lower.split(|letter: char| !(letter.is_alphanumeric() || letter == '%'));
    parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".")
}

/// Guesses which column may be meant by one of our names, from the words in the names of the columns.
pub fn guess(ours: &str, names: &[String]) -> Option<usize> {
    let words: &[&str] = match ours {
        "t" => &["time", "stamp", "sec", "clock", "zeit"],
        "ax" | "ay" | "az" => &["acc", "force_", "lin"],
        _ => &["gyr", "ang", "rate", "omega", "vel", "rot"],
    };
    let axis = ours.chars().nth(1);
    names.iter().position(|name| {
        let lower = name.to_lowercase();
        let parted = axis.is_some() && normal(name) == format!("{}.{}", &ours[..1], &ours[1..]);
        let has_word = parted || words.iter().any(|word| lower.contains(word));
        let has_axis = axis.is_none_or(|axis| {
            let number = match axis {
                'x' => '0',
                'y' => '1',
                _ => '2',
            };
            let (without_unit, _) = split_unit(&lower);
            let last = without_unit.trim_end_matches([']', ')', ' ']).chars().last();
            last == Some(axis) || last == Some(number)
        });
        has_word && has_axis
    })
}

/// Returns a mapping for each of several sensors whose axes `triple` were found in a header. A mapping includes the axes of
/// the other kind whose names begin alike. If the header has our names for a kind, the mapping leaves that kind out.
pub fn choices(triple: Triple, found: &[[usize; 3]], names: &[String]) -> Vec<Mapping> {
    let other = match triple {
        Triple::Acceleration => Triple::Rate,
        Triple::Rate => Triple::Acceleration,
    };
    let is_ours = |axis: &str| names.iter().any(|name| name == axis);
    let others = match find_with_units(other, names) {
        _ if other.ours().into_iter().any(is_ours) => Vec::new(),
        Found::Nowhere => Vec::new(),
        Found::At(only) => vec![only],
        Found::Several(several) => several,
    };
    let of_sensor = |axes: &[usize; 3]| {
        let [x, ..] = *axes;
        let alike = |[other, ..]: &&[usize; 3]| common_start(&names[x], &names[*other]);
        // First one of several that are equally alike.
        let with = others.iter().rev().max_by_key(alike);
        let ours = [triple.ours(), other.ours()].concat().into_iter();
        let theirs = axes.iter().chain(with.into_iter().flatten());
        let pairs = ours.zip(theirs.map(|index| names[*index].clone()));
        let mut columns: Vec<_> = pairs.collect();
        columns.sort_unstable();
        Mapping { columns }
    };
    found.iter().map(of_sensor).collect()
}

/// Number of bytes with which both names begin.
fn common_start(a: &str, b: &str) -> usize {
    let both = a.bytes().zip(b.bytes());
    both.take_while(|(a, b)| a == b).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn axes_are_found_under_foreign_names() {
        for header in [
            "q,/imu/linear_acceleration/x,/imu/linear_acceleration/y,/imu/linear_acceleration/z",
            "q,imu_state.accelerometer[0],imu_state.accelerometer[1],imu_state.accelerometer[2]",
            "q,imu.accelerometer[0],imu.accelerometer[1],imu.accelerometer[2]",
            "q,field.imu.accelerometer0,field.imu.accelerometer1,field.imu.accelerometer2",
            "q,imu_acc_x,imu_acc_y,imu_acc_z",
            "q,AccX,AccY,AccZ",
        ] {
            let found = find(Triple::Acceleration, &names(header));
            assert_eq!(found, Found::At([1, 2, 3]), "{header}");
            assert_eq!(find(Triple::Rate, &names(header)), Found::Nowhere);
        }
        assert_eq!(find(Triple::Rate, &names("gyro_z,gyro_y,gyro_x")), Found::At([2, 1, 0]));
    }

    #[test]
    fn short_names_of_rates_are_known_and_come_last() {
        let alone = names("ax,ay,az,gx,gy,gz");
        assert_eq!(find(Triple::Rate, &alone), Found::At([3, 4, 5]));
        // With longer names present they may be gravity.
        let beside = names("gyro_x,gyro_y,gyro_z,gx,gy,gz");
        assert_eq!(find(Triple::Rate, &beside), Found::At([0, 1, 2]));
        assert_eq!(find(Triple::Acceleration, &alone), Found::Nowhere);
    }

    #[test]
    fn partial_words_and_bare_axes_are_not_a_sensor() {
        for header in ["vacc_x,vaccel_y,vacc_z", "acc_x,acc_y", "x,y,z"] {
            let found = find(Triple::Acceleration, &names(header));
            assert_eq!(found, Found::Nowhere, "{header}");
        }
    }

    #[test]
    fn two_sensors_of_one_kind_are_both_found() {
        let header = names("/l/acc/x,/l/acc/y,/l/acc/z,/r/acc/x,/r/acc/y,/r/acc/z");
        assert_eq!(find(Triple::Acceleration, &header), Found::Several(vec![[0, 1, 2], [3, 4, 5]]));
    }

    #[test]
    fn times_are_found_with_the_unit_of_their_names() {
        for (header, time) in [
            ("a,__time", FoundTime::Column(1, Some(TimeUnit::Seconds))),
            ("%time,time", FoundTime::Column(0, Some(TimeUnit::Nanoseconds))),
            ("Timestamp,b", FoundTime::Column(0, None)),
            ("t_us,b", FoundTime::Column(0, Some(TimeUnit::Microseconds))),
            ("header.stamp.sec,header.stamp.nanosec", FoundTime::Stamp(0, 1)),
        ] {
            assert_eq!(find_time(&names(header)), Some(time), "{header}");
        }
        assert_eq!(find_time(&names("mood,uptime")), None);
    }

    #[test]
    fn unit_in_brackets_is_not_part_of_a_name() {
        for (name, split) in [
            ("acc_x [g]", ("acc_x", Some("g"))),
            ("ax (m/s^2)", ("ax", Some("m/s^2"))),
            ("gyr_x<°/s>", ("gyr_x", Some("°/s"))),
            ("Time [ s ]", ("Time", Some("s"))),
            ("imu.accelerometer[0]", ("imu.accelerometer[0]", None)),
            ("[g]", ("[g]", None)),
            ("acc_x", ("acc_x", None)),
            ("acc]", ("acc]", None)),
        ] {
            assert_eq!(split_unit(name), split, "{name}");
        }
    }

    #[test]
    fn unknown_name_is_guessed() {
        let header = names("Time [s],Body Acc X (g),GyrRaw_x,mood");
        assert_eq!(guess("t", &header), Some(0));
        assert_eq!(guess("ax", &header), Some(1));
        assert_eq!(guess("wx", &header), Some(2));
        assert_eq!(guess("wz", &header), None);
        let header = names("Zeit,a_x,a_y,w_x");
        assert_eq!(guess("t", &header), Some(0));
        assert_eq!(guess("ay", &header), Some(2));
        assert_eq!(guess("wx", &header), Some(3));
    }

    fn chosen(header: &str) -> Vec<String> {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        let kinds = [Triple::Acceleration, Triple::Rate];
        let several = kinds.into_iter().find_map(|triple| match find_with_units(triple, &names) {
            Found::Several(found) => Some(choices(triple, &found, &names)),
            _ => None,
        });
        let mappings = several.expect("several sensors").into_iter();
        mappings.map(|mapping| mapping.to_string()).collect()
    }

    #[test]
    fn sensors_are_paired_by_the_beginning_of_their_names() {
        let header = "/r/gyro/x,/r/gyro/y,/r/gyro/z,/l/acc/x,/l/acc/y,/l/acc/z,\
                  /l/gyro/x,/l/gyro/y,/l/gyro/z,/r/acc/x,/r/acc/y,/r/acc/z";
        let of = |foot: char| {
            format!(
                "ax=/{foot}/acc/x,ay=/{foot}/acc/y,az=/{foot}/acc/z,\
             wx=/{foot}/gyro/x,wy=/{foot}/gyro/y,wz=/{foot}/gyro/z"
            )
        };
        assert_eq!(chosen(header), [of('l'), of('r')]);
    }

    #[test]
    fn only_sensor_of_the_other_kind_is_in_each_choice() {
        let header = "acc_x,acc_y,acc_z,l_gyro_x,l_gyro_y,l_gyro_z,r_gyro_x,r_gyro_y,r_gyro_z";
        let chosen = chosen(header);
        assert_eq!(chosen.len(), 2);
        assert!(chosen.iter().all(|choice| choice.starts_with("ax=acc_x,")));
        assert!(chosen[1].ends_with(",wx=r_gyro_x,wy=r_gyro_y,wz=r_gyro_z"));
        let ours = "ax,ay,az,l_gyro_x,l_gyro_y,l_gyro_z,r_gyro_x,r_gyro_y,r_gyro_z";
        assert_eq!(self::chosen(ours)[0], "wx=l_gyro_x,wy=l_gyro_y,wz=l_gyro_z");
    }
}
