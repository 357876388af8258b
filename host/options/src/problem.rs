//! Reasons why the text of an option is invalid.

use estimator_core::Axis;
use thiserror::Error;

use crate::columns::OTHERS;

/// Reason why the text of an option is invalid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OptionProblem {
    /// This is not a [`Scale`](crate::units::Scale).
    #[error(
        "{0:?} is no scale: write the factors of accelerometer and gyroscope, finite and not 0, such as \
         0.000122,0.07 with units g,dps; a third is that of the load"
    )]
    Scale(String),
    /// This is not the name of a unit.
    #[error("{0:?} is not a unit: write m/s2 or g, and rad/s or dps, such as g,dps")]
    UnknownUnit(String),
    /// These are two units of the same sensor.
    #[error("{0:?} has two units for one sensor: write m/s2 or g, and rad/s or dps")]
    TwoUnits(String),
    /// This part of a [`Mapping`](crate::mapping::Mapping) has no equals sign.
    #[error("{0:?} is not a pair: write OURS=THEIRS, such as ax=linear_acceleration.x")]
    NotAPair(String),
    /// This is not one of our names of columns.
    #[error(
        "there is no column {0:?} to map to; there are {axes}, {others}",
        axes = Axis::ALL.map(Axis::name).join(", "),
        others = OTHERS.join(", ")
    )]
    UnknownColumn(String),
    /// Two columns of the file are mapped to this one of ours.
    #[error("{0} is mapped twice")]
    MappedTwice(&'static str),
    /// This column of the file is mapped to two of ours.
    #[error("column {0:?} is mapped twice")]
    TakenTwice(String),
    /// This is not a [`LoadTopic`](crate::topics::LoadTopic).
    #[error(
        "{0:?} is not a topic: write TOPIC or TOPIC:FIELD, such as /foot/wrench:force.z or /lowstate:foot_force[0]"
    )]
    LoadTopic(String),
    /// This is not a [`Rename`](crate::topics::Rename).
    #[error("{0:?} is not a name: write OLD=NEW, such as leg_1=FL")]
    Rename(String),
}
