//! Six axes of an IMU in messages of any type, found by their names or named by the user.

use estimator_core::Axis;

use super::super::mapping::{Mapping, is_axis};
use super::super::names::{Found, Triple, find};
use super::definition::{Definition, Path};
use super::messages::{Imu, Time};
use super::storage::Channel;

/// Axes of one IMU in the messages of a topic.
pub(super) struct Fields {
    /// Topic of the messages.
    pub(super) topic: String,
    definition: Definition,
    /// In the order of [`Axis::ALL`].
    axes: [Path; 6],
    /// Seconds and nanoseconds.
    stamp: Option<[Path; 2]>,
}

impl Fields {
    /// Axes in a part of the messages of a channel; the error is half a sentence.
    pub(super) fn of(channel: &Channel, part: &str, mapping: &Mapping) -> Result<Self, String> {
        let definition = Definition::of(&channel.message, channel.definition().as_deref())?;
        let numbers = definition.numbers(part)?;
        let names: Vec<String> = numbers.iter().map(|(name, _)| name.clone()).collect();
        let axes = if mapping.is_empty() {
            let axes = recognised(&names).ok_or_else(|| {
                format!(
                    "no accelerometer and gyroscope among {}; --map names the six axes, such as \
                     ax=imu.accelerometer[0]",
                    definition.listed(part)
                )
            })?;
            axes.map(|index| numbers[index].1.clone())
        } else {
            let within = if part.is_empty() {
                String::new()
            } else {
                format!("{part}.")
            };
            let mut axes: [Path; 6] = Default::default();
            for (path, axis) in axes.iter_mut().zip(Axis::ALL) {
                let mut pairs = mapping.pairs();
                let named = pairs.find(|(ours, _)| *ours == axis.name());
                let (_, name) =
                    named.ok_or_else(|| format!("--map does not name {}", axis.name()))?;
                *path = definition.number(&format!("{within}{name}"))?;
            }
            if let Some((other, _)) = mapping.pairs().find(|(ours, _)| !is_axis(ours)) {
                return Err(format!(
                    "--map of a message names its axes alone, not {other}: a load is given as --load-topic"
                ));
            }
            axes
        };
        let stamp = definition.stamp(part).or_else(|| definition.stamp(""));
        Ok(Self {
            topic: channel.topic.clone(),
            definition,
            axes,
            stamp,
        })
    }

    /// Sample of a message; the error is half a sentence.
    pub(super) fn imu(&self, payload: &[u8]) -> Result<Imu, String> {
        let paths: Vec<&Path> = self
            .axes
            .iter()
            .chain(self.stamp.iter().flatten())
            .collect();
        let values = self.definition.values(payload, &paths)?;
        let [ax, ay, az, wx, wy, wz, stamp @ ..] = &values[..] else {
            return Err("it lacks an axis".to_owned());
        };
        Ok(Imu::of(
            Time::of_numbers(stamp),
            [*ax, *ay, *az],
            [*wx, *wy, *wz],
        ))
    }
}

/// Indices of the six axes among names, if there is one sensor of each kind.
fn recognised(names: &[String]) -> Option<[usize; 6]> {
    let ours = |triple: Triple| {
        let ours = triple
            .ours()
            .map(|axis| names.iter().position(|name| name == axis));
        match ours {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        }
    };
    let triple = |triple| match find(triple, names) {
        Found::At(axes) => Some(axes),
        Found::Nowhere => ours(triple),
        Found::Several(..) => None,
    };
    let [ax, ay, az] = triple(Triple::Acceleration)?;
    let [wx, wy, wz] = triple(Triple::Rate)?;
    Some([ax, ay, az, wx, wy, wz])
}
