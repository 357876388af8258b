//! Definitions of types in bags that have none, as rosbag2's before ROS 2 Iron.
//!
//! Sources: `sensor_msgs` of <https://github.com/ros2/common_interfaces>, and `unitree_go` of
//! <https://github.com/unitreerobotics/unitree_ros2>.

/// Types with their definitions.
const KNOWN: [(&str, &str); 5] = [
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec"),
    (
        "builtin_interfaces/msg/Duration",
        "int32 sec\nuint32 nanosec",
    ),
    (
        "std_msgs/msg/Header",
        "builtin_interfaces/Time stamp\nstring frame_id",
    ),
    (
        "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    ),
    // Of a Go2 and of a GO1 that speaks ROS 2.
    ("unitree_go/msg/LowState", include_str!("low_state.msg")),
];

/// Definition of a type, if known.
pub(super) fn text(message: &str) -> Option<&'static str> {
    let (_, text) = KNOWN.iter().find(|(name, _)| *name == message)?;
    Some(text)
}
