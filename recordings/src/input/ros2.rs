//! Tables that `ros2 topic echo --csv` writes of a `sensor_msgs/msg/Imu`: no header, the fields of
//! the message in order.
//!
//! Source: `message_to_csv` of `rosidl_runtime_py`, and `sensor_msgs/msg/Imu.msg`.

use csv::StringRecord;

use super::table::Row;

/// How many cells a message has: a stamp in two, a name, a quaternion and its covariance, two
/// vectors and theirs.
const CELLS: usize = 40;

/// How far from 1 the length of a quaternion may be.
const LENGTH_TOLERANCE: f64 = 0.01;

/// The names of the cells.
fn names() -> impl Iterator<Item = String> {
    let stamp = [
        "header.stamp.sec",
        "header.stamp.nanosec",
        "header.frame_id",
    ];
    let field = |field: &'static str, parts: &'static str| {
        let covariance = (0..9).map(move |k| format!("{field}_covariance[{k}]"));
        let parts = parts.chars().map(move |part| format!("{field}.{part}"));
        parts.chain(covariance)
    };
    stamp
        .into_iter()
        .map(str::to_owned)
        .chain(field("orientation", "xyzw"))
        .chain(field("angular_velocity", "xyz"))
        .chain(field("linear_acceleration", "xyz"))
}

/// The header that a table of such messages would have, where `first` is a row of one: the number
/// of its cells is right, a stamp comes first, and the orientation is one or said to be unknown.
pub(super) fn header(first: &Row) -> Option<StringRecord> {
    let cells: Vec<&str> = first.cells().collect();
    if cells.len() != CELLS || cells[..2].iter().any(|cell| cell.parse::<i64>().is_err()) {
        return None;
    }
    let number = |cell: &&str| cell.parse::<f64>().ok();
    let numbers: Option<Vec<f64>> = cells[3..].iter().map(number).collect();
    let numbers = numbers?;
    let length = numbers[..4]
        .iter()
        .map(|part| part * part)
        .sum::<f64>()
        .sqrt();
    // The message's way to say that there is no orientation: -1 as the first covariance.
    let unknown = length == 0.0 || numbers[4] == -1.0;
    ((length - 1.0).abs() <= LENGTH_TOLERANCE || unknown).then(|| names().collect())
}
