//! Six axes of an IMU in messages of any type, found by their names or named by the user.

use estimator_core::Axis;

use crate::definition::{Definition, FieldPath, within};
use crate::messages::Channel;
use options::names::{Found, Triple, find};
use options::{Mapping, is_axis};
use samples::ros::{Header, Imu, Time};
use stored::error::{FieldsProblem, MessageProblem};

/// Axes of one IMU in the messages of a topic.
pub(super) struct Fields {
    /// Topic of the messages.
    pub(super) topic: String,
    definition: Definition,
    /// In the order of [`Axis::ALL`].
    axes: [FieldPath; 6],
    /// Seconds and nanoseconds.
    stamp: Option<[FieldPath; 2]>,
    frame: Option<FieldPath>,
    /// First covariances of rates and accelerations, if the axes are in a `sensor_msgs/msg/Imu`.
    covariances: Option<[FieldPath; 2]>,
    /// Names of the axes, if they were found by their names.
    pub(super) found: Option<[String; 6]>,
}

impl Fields {
    /// Axes in a part of the messages of a channel.
    pub(super) fn of(
        channel: &Channel,
        part: &str,
        mapping: &Mapping,
    ) -> Result<Self, FieldsProblem> {
        let definition = Definition::of_channel(channel)?;
        let numbers = definition.numbers(part)?;
        let names: Vec<String> = numbers.iter().map(|(name, _)| name.clone()).collect();
        let mut found = None;
        // An exchange of axes applies to the readings.
        let axes = if mapping.columns().next().is_none() {
            let no_axes = || FieldsProblem::NoAxes(definition.names(part));
            let axes = recognised(&names).ok_or_else(no_axes)?;
            if part.is_empty() && is_low_state(&channel.message) {
                let is_present = |part: &&&str| definition.numbers(part).is_ok();
                let part = TRUNK_PARTS.iter().find(is_present).copied().unwrap_or(TRUNK_PARTS[0]);
                let address = format!("{}.{part}", channel.topic);
                return Err(FieldsProblem::OfTrunk { part, address });
            }
            found = Some(axes.map(|index| numbers[index].0.clone()));
            axes.map(|index| numbers[index].1.clone())
        } else {
            let mut axes: [FieldPath; 6] = Default::default();
            for (path, axis) in axes.iter_mut().zip(Axis::ALL) {
                let mut pairs = mapping.pairs();
                let named = pairs.find(|(ours, _)| *ours == axis.name());
                let (_, name) = named.ok_or_else(|| FieldsProblem::NotNamed(axis.name()))?;
                *path = definition.number(&within(part, name))?;
            }
            if let Some((name, _)) = mapping.pairs().find(|(ours, _)| !is_axis(ours)) {
                return Err(FieldsProblem::NoAxis(name));
            }
            axes
        };
        let stamp = definition.stamp(part).or_else(|| definition.stamp(""));
        let frame = definition.frame(part).or_else(|| definition.frame(""));
        let covariances = found.as_ref().and_then(|_| definition.covariances(part));
        Ok(Self {
            topic: channel.topic.clone(),
            definition,
            axes,
            stamp,
            frame,
            covariances,
            found,
        })
    }

    /// Sample of a message.
    pub(super) fn imu(&self, payload: &[u8]) -> Result<Imu, MessageProblem> {
        let beside = self.stamp.iter().chain(&self.covariances).flatten();
        let paths: Vec<&FieldPath> = self.axes.iter().chain(beside).collect();
        let decoded = self.definition.decode(payload, &paths, self.frame.as_ref())?;
        let values: Vec<f64> = decoded.numbers.iter().map(|number| number.value).collect();
        // The numbers are in the order of the paths.
        let (axes, rest) = values.split_at(self.axes.len());
        let (stamp, covariances) =
            rest.split_at(self.stamp.as_ref().map_or(0, |stamp| stamp.len()));
        let header = Header { stamp: Time::of_numbers(stamp), frame_id: decoded.frame };
        let covariances = match covariances {
            [rates, accelerations] => [*rates, *accelerations],
            _ => [0.0; 2],
        };
        let accelerations = [axes[0], axes[1], axes[2]];
        let rates = [axes[3], axes[4], axes[5]];
        Ok(Imu::of(header, accelerations, rates, covariances))
    }
}

/// Returns whether messages of this type are states of a Unitree robot, whose one IMU is on the trunk.
#[must_use]
pub fn is_low_state(message: &str) -> bool {
    message.ends_with("/LowState")
}

/// The part of such a state that is this IMU: in ROS 2, and in ROS 1 (`unitree_legged_msgs`).
pub(super) const TRUNK_PARTS: [&str; 2] = ["imu_state", "imu"];

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
