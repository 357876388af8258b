//! Six axes of an IMU in messages of any type, found by their names or named by the user.

use estimator_core::Axis;

use super::super::table::mapping::{Mapping, is_axis};
use super::super::table::names::{Found, Triple, find};
use super::definition::{Definition, Path, within};
use super::storage::Channel;
use crate::ros::{Header, Imu, Time};

/// End of the types of states of Unitree's robots, whose one IMU is that of the trunk.
const LOW_STATE: &str = "/LowState";

/// The part of such a state that is this IMU.
pub(super) const TRUNK: &str = "imu_state";

/// Axes of one IMU in the messages of a topic.
pub(super) struct Fields {
    /// Topic of the messages.
    pub(super) topic: String,
    definition: Definition,
    /// In the order of [`Axis::ALL`].
    axes: [Path; 6],
    /// Seconds and nanoseconds.
    stamp: Option<[Path; 2]>,
    frame: Option<Path>,
    /// First covariances of rates and accelerations, where axes are those of a `sensor_msgs/msg/Imu`.
    covariances: Option<[Path; 2]>,
    /// Which fields were taken, if they were found by their names.
    pub(super) taken: Option<String>,
}

impl Fields {
    /// Axes in a part of the messages of a channel; the error is half a sentence.
    pub(super) fn of(channel: &Channel, part: &str, mapping: &Mapping) -> Result<Self, String> {
        let definition = Definition::of_channel(channel)?;
        let numbers = definition.numbers(part)?;
        let names: Vec<String> = numbers.iter().map(|(name, _)| name.clone()).collect();
        let mut taken = None;
        let axes = if mapping.is_empty() {
            let axes = recognised(&names).ok_or_else(|| {
                format!(
                    "no accelerometer and gyroscope among {}; --map names the six axes, such as \
                     ax=imu.accelerometer[0]",
                    definition.listed(part)
                )
            })?;
            if part.is_empty() && channel.message.ends_with(LOW_STATE) {
                let topic = &channel.topic;
                return Err(format!(
                    "{TRUNK} is the IMU of the robot's trunk, not of a foot; --topic {topic}.{TRUNK} reads it all the same"
                ));
            }
            let names = Axis::ALL.iter().zip(axes);
            let named =
                names.map(|(axis, index)| format!("{} is {}", axis.name(), numbers[index].0));
            taken = Some(named.collect::<Vec<_>>().join(", "));
            axes.map(|index| numbers[index].1.clone())
        } else {
            let mut axes: [Path; 6] = Default::default();
            for (path, axis) in axes.iter_mut().zip(Axis::ALL) {
                let mut pairs = mapping.pairs();
                let named = pairs.find(|(ours, _)| *ours == axis.name());
                let (_, name) =
                    named.ok_or_else(|| format!("--map does not name {}", axis.name()))?;
                *path = definition.number(&within(part, name))?;
            }
            if let Some((other, _)) = mapping.pairs().find(|(ours, _)| !is_axis(ours)) {
                return Err(format!(
                    "--map of a message names its axes alone, not {other}: a load is given as --load-topic"
                ));
            }
            axes
        };
        let stamp = definition.stamp(part).or_else(|| definition.stamp(""));
        let frame = definition.frame(part).or_else(|| definition.frame(""));
        let covariances = taken.as_ref().and_then(|_| definition.covariances(part));
        Ok(Self {
            topic: channel.topic.clone(),
            definition,
            axes,
            stamp,
            frame,
            covariances,
            taken,
        })
    }

    /// Sample of a message; the error is half a sentence.
    pub(super) fn imu(&self, payload: &[u8]) -> Result<Imu, String> {
        let beside = self.stamp.iter().chain(&self.covariances).flatten();
        let paths: Vec<&Path> = self.axes.iter().chain(beside).collect();
        let (found, frame) = (self.definition).found(payload, &paths, self.frame.as_ref())?;
        let values: Vec<f64> = found.into_iter().map(|(_, value)| value).collect();
        let [ax, ay, az, wx, wy, wz, rest @ ..] = &values[..] else {
            return Err("it lacks an axis".to_owned());
        };
        let (stamp, covariances) =
            rest.split_at(self.stamp.as_ref().map_or(0, |stamp| stamp.len()));
        let header = Header { stamp: Time::of_numbers(stamp), frame_id: frame };
        let covariances = match covariances {
            [rates, accelerations] => [*rates, *accelerations],
            _ => [0.0; 2],
        };
        let (accelerations, rates) = ([*ax, *ay, *az], [*wx, *wy, *wz]);
        Ok(Imu::of(header, accelerations, rates, covariances))
    }
}

/// Indices of the six axes among names, if there is one sensor of each kind.
fn recognised(names: &[String]) -> Option<[usize; 6]> {
    // As in tables, our own names come first.
    let triple = |triple: Triple| match (triple.own(names), find(triple, names)) {
        (Some(axes), _) | (None, Found::At(axes)) => Some(axes),
        (None, Found::Nowhere | Found::Several(..)) => None,
    };
    let [ax, ay, az] = triple(Triple::Acceleration)?;
    let [wx, wy, wz] = triple(Triple::Rate)?;
    Some([ax, ay, az, wx, wy, wz])
}
