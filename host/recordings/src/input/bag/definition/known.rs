//! Definitions of types in bags that have none, as rosbag2's before ROS 2 Iron.
//!
//! Sources: <https://github.com/ros2/common_interfaces>, and `unitree_go` of <https://github.com/unitreerobotics/unitree_ros2>.

/// Types with their definitions.
const KNOWN: [(&str, &str); 14] = [
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec"),
    ("std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id"),
    (
        "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    ),
    ("std_msgs/msg/Float32", "float32 data"),
    ("std_msgs/msg/Float64", "float64 data"),
    ("std_msgs/msg/Float32MultiArray", "MultiArrayLayout layout\nfloat32[] data"),
    ("std_msgs/msg/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data"),
    ("std_msgs/msg/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset"),
    ("std_msgs/msg/MultiArrayDimension", "string label\nuint32 size\nuint32 stride"),
    ("geometry_msgs/msg/WrenchStamped", "std_msgs/Header header\nWrench wrench"),
    ("geometry_msgs/msg/Wrench", "Vector3 force\nVector3 torque"),
    ("geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
    // Of a Go2 and of a GO1 that speaks ROS 2.
    ("unitree_go/msg/LowState", include_str!("low_state.msg")),
];

/// Definition of a type, if known.
pub(super) fn text(message: &str) -> Option<&'static str> {
    let (_, text) = KNOWN.iter().find(|(name, _)| *name == message)?;
    Some(text)
}
