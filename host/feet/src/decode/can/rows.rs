//! Conversion of a foot's frames to the cells of a row.

use wire::Pdo;
use wire::pdo::{Acceleration, Attitude, Axes, Bias, Health, P8, Rate, ShortTime};

use crate::decode::row::ContactRow;

/// Completes the row of the contact at `short` with another frame of the foot, and returns whether it belongs to that
/// contact. The values of a frame with another time are discarded.
pub(super) fn complete(row: &mut ContactRow, pdo: Pdo, bytes: &[u8; 8], short: ShortTime) -> bool {
    let mut time = short;
    match pdo {
        Pdo::Contact => {}
        Pdo::Axes => {
            let axes = Axes::decode(bytes);
            time = axes.timestamp;
            row.axes = Some(axes.probabilities.map(P8::probability)).filter(|_| time == short);
        }
        Pdo::Attitude => row.orientation = Some(Attitude::decode(bytes).orientation()),
        Pdo::Acceleration => {
            let acceleration = Acceleration::decode(bytes);
            time = acceleration.timestamp;
            row.acceleration = Some(acceleration.acceleration()).filter(|_| time == short);
        }
        Pdo::Rate => {
            let rate = Rate::decode(bytes);
            time = rate.timestamp;
            row.rate = Some(rate.rate()).filter(|_| time == short);
        }
        Pdo::Bias => {
            let bias = Bias::decode(bytes);
            row.bias = Some(bias.bias());
            row.temperature = Some(bias.temperature());
        }
        Pdo::Health => row.flags = Some(Health::decode(bytes).flags),
    }
    time == short
}

/// Name of a PDO in reports.
pub(super) const fn kind_name(pdo: Pdo) -> &'static str {
    match pdo {
        Pdo::Contact => "contact",
        Pdo::Axes => "axes",
        Pdo::Attitude => "attitude",
        Pdo::Acceleration => "acceleration",
        Pdo::Rate => "rate",
        Pdo::Bias => "bias",
        Pdo::Health => "health",
    }
}
