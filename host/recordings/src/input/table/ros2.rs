//! Tables written by `ros2 topic echo --csv` for `sensor_msgs/msg/Imu`: no header, the fields of the message in
//! order.
//!
//! Source: `message_to_csv` of `rosidl_runtime_py`, and `sensor_msgs/msg/Imu.msg`.

use csv::StringRecord;

use super::reader::Row;

/// Number of cells of a message: a stamp in two cells, a name, a quaternion and its covariance, two vectors and
/// their covariances.
const CELLS: usize = 40;

/// Tolerance of the length of a quaternion about 1.
const LENGTH_TOLERANCE: f64 = 0.01;

/// Names of the cells.
fn names() -> impl Iterator<Item = String> {
    let stamp = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"];
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

/// Header for a table of such messages, if `first` is one of them: the number of cells matches, a stamp comes
/// first, and the orientation is a unit quaternion or marked as unknown.
pub(super) fn header(first: &Row) -> Option<StringRecord> {
    let cells: Vec<&str> = first.cells().collect();
    if cells.len() != CELLS || cells[..2].iter().any(|cell| cell.parse::<i64>().is_err()) {
        return None;
    }
    let number = |cell: &&str| cell.parse::<f64>().ok();
    let numbers: Option<Vec<f64>> = cells[3..].iter().map(number).collect();
    let numbers = numbers?;
    let length = numbers[..4].iter().map(|part| part * part).sum::<f64>().sqrt();
    // A first covariance of -1 marks the orientation as unknown.
    let unknown = length == 0.0 || numbers[4] == -1.0;
    ((length - 1.0).abs() <= LENGTH_TOLERANCE || unknown).then(|| names().collect())
}
