//! Mountings as text: `x,-z,y`, or a quaternion such as `0.8,0.6,0,0`.

use std::collections::BTreeMap;
use std::str::FromStr;

use estimator_core::{Mounting, MountingParams, Quaternion, SensorAxis};

use crate::input::{Correction, is_among};

/// Parses the mounting of the sensor: for each of the foot's x, y and z the axis of the sensor along it, such as
/// `x,-z,y`, or a unit quaternion `w,x,y,z` from the sensor's frame to the foot's.
///
/// # Errors
/// A sentence with the accepted notation, or the necessary change.
pub fn parse_axes(text: &str) -> Result<Mounting, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let axis = |name: &&str| {
        let name = name.strip_prefix('+').unwrap_or(name);
        SensorAxis::ALL.into_iter().find(|axis| axis.name() == name)
    };
    let axes: Option<Vec<_>> = parts.iter().map(axis).collect();
    let numbers: Option<Vec<f32>> = parts.iter().map(|number| number.parse().ok()).collect();
    let params = match (axes.as_deref(), numbers.as_deref()) {
        (Some(&[x, y, z]), _) => MountingParams::Axes([x, y, z]),
        (_, Some(&[w, x, y, z])) => MountingParams::Rotation(Quaternion { w, x, y, z }),
        _ => {
            return Err(format!(
                "{text:?} is neither axes nor a quaternion: write for the foot's x, y and z (up) the axis of the sensor that lies along it, such as x,-z,y, or a unit quaternion w,x,y,z from the sensor's frame to the foot's"
            ));
        }
    };
    params.validate().map_err(|error| error.to_string())
}

/// Notation of a mounting, from which [`parse_axes`] restores every bit.
#[must_use]
pub fn axes_text(mounting: &Mounting) -> String {
    match mounting.params() {
        MountingParams::Axes(axes) => axes.map(SensorAxis::name).join(","),
        MountingParams::Rotation(Quaternion { w, x, y, z }) => format!("{w},{x},{y},{z}"),
    }
}

/// Mounting of the sensors: the same in all feet, or one of each foot.
#[derive(Clone, Debug, PartialEq)]
pub enum FootAxes {
    /// Of all feet.
    All(Mounting),
    /// By the name of the foot.
    Each(BTreeMap<String, Mounting>),
}

impl FootAxes {
    /// The first foot with a mounting that is not among these names.
    pub fn absent(&self, names: &[&str]) -> Option<&str> {
        let Self::Each(mountings) = self else {
            return None;
        };
        let mut feet = mountings.keys().map(String::as_str);
        feet.find(|foot| !is_among(foot, names))
    }

    /// Replaces the mountings in the correction of all feet and in those of single feet.
    pub fn set(&self, all: &mut Correction, feet: &mut BTreeMap<String, Correction>) {
        match self {
            Self::All(mounting) => {
                all.mounting = *mounting;
                for correction in feet.values_mut() {
                    correction.mounting = *mounting;
                }
            }
            Self::Each(mountings) => {
                for (foot, mounting) in mountings {
                    let mut names = feet.keys();
                    let known = names.find(|name| name.eq_ignore_ascii_case(foot)).cloned();
                    let own = feet.entry(known.unwrap_or_else(|| foot.clone()));
                    own.or_insert(*all).mounting = *mounting;
                }
            }
        }
    }
}

impl FromStr for FootAxes {
    type Err = String;

    /// Reads a mounting as [`parse_axes`] does, or one for each foot, such as `FL=x,y,z,FR=-x,-y,z`.
    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains('=') {
            return parse_axes(text).map(Self::All);
        }
        let mut feet: BTreeMap<String, String> = BTreeMap::new();
        let mut name: Option<&str> = None;
        for part in text.split(',') {
            if let Some((foot, first)) = part.split_once('=') {
                let foot = foot.trim();
                if foot.is_empty() || is_among(foot, feet.keys()) {
                    return Err(format!("{text:?} names no foot before =, or one twice"));
                }
                feet.insert(foot.to_owned(), first.to_owned());
                name = Some(foot);
            } else if let Some(axes) = name.and_then(|name| feet.get_mut(name)) {
                *axes = format!("{axes},{part}");
            } else {
                return Err(format!("{text:?} has {part:?} before the name of a foot"));
            }
        }
        let parsed = feet.into_iter().map(|(foot, axes)| {
            let mounting = parse_axes(&axes).map_err(|error| format!("{foot}: {error}"))?;
            Ok((foot, mounting))
        });
        parsed.collect::<Result<_, String>>().map(Self::Each)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_each_foot_are_read() {
        let axes = |text: &str| text.parse::<FootAxes>();
        let turned = parse_axes("x,-z,y").unwrap();
        assert_eq!(axes("x,-z,y"), Ok(FootAxes::All(turned)));
        let Ok(FootAxes::Each(feet)) = axes("FL=x,-z,y,fr=1,0,0,0") else {
            panic!("two feet");
        };
        assert_eq!(feet["FL"], turned);
        assert_eq!(feet["fr"], Mounting::IDENTITY);
        for (text, why) in [
            ("x,FL=y,z", "has \"x\" before the name of a foot"),
            ("FL=x,y,z,fl=x,y,z", "one twice"),
            ("=x,y,z", "names no foot"),
            ("FL=x,y", "FL: \"x,y\" is neither axes nor a quaternion"),
        ] {
            let said = axes(text).unwrap_err();
            assert!(said.contains(why), "{text}: {said}");
        }
    }

    #[test]
    fn identity_is_read_in_every_notation() {
        for text in ["x,y,z", " +x, y ,z", "1,0,0,0", "-1,0,-0,0", "0.9995,0,0,0"] {
            assert_eq!(parse_axes(text), Ok(Mounting::IDENTITY), "{text}");
        }
        assert_eq!(axes_text(&Mounting::IDENTITY), "x,y,z");
    }

    #[test]
    fn mounting_round_trips_through_text() {
        for x in SensorAxis::ALL {
            for y in SensorAxis::ALL {
                for z in SensorAxis::ALL {
                    if let Ok(mounting) = MountingParams::Axes([x, y, z]).validate() {
                        assert_eq!(parse_axes(&axes_text(&mounting)), Ok(mounting));
                    }
                }
            }
        }
        for text in ["0.707,0.707,0,0", "0.1,-0.7,0.5,0.4998", "1e-3,0.6,0.8,0"] {
            let mounting = parse_axes(text).expect(text);
            assert_eq!(parse_axes(&axes_text(&mounting)), Ok(mounting), "{text}");
        }
    }

    #[test]
    fn unreadable_text_is_rejected_with_the_expected_format() {
        for text in ["", "x", "x,y", "x,y,z,x", "x,y,w", "1,0,0", "1,0,0,0,0", "X,Y,Z", "--x,y,z"] {
            assert!(
                parse_axes(text).is_err_and(|error| error.contains("such as x,-z,y")),
                "{text}"
            );
        }
    }
}
