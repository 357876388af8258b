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
    ("unitree_go/msg/LowState", LOW_STATE),
];

/// `unitree_go/msg/LowState` of a Go2 and of a GO1 that speaks ROS 2.
const LOW_STATE: &str = "
uint8[2] head
uint8 level_flag
uint8 frame_reserve
uint32[2] sn
uint32[2] version
uint16 bandwidth
IMUState imu_state
MotorState[20] motor_state
BmsState bms_state
int16[4] foot_force
int16[4] foot_force_est
uint32 tick
uint8[40] wireless_remote
uint8 bit_flag
float32 adc_reel
int8 temperature_ntc1
int8 temperature_ntc2
float32 power_v
float32 power_a
uint16[4] fan_frequency
uint32 reserve
uint32 crc
===
MSG: unitree_go/IMUState
float32[4] quaternion
float32[3] gyroscope
float32[3] accelerometer
float32[3] rpy
int8 temperature
===
MSG: unitree_go/MotorState
uint8 mode
float32 q
float32 dq
float32 ddq
float32 tau_est
float32 q_raw
float32 dq_raw
float32 ddq_raw
int8 temperature
uint32 lost
uint32[2] reserve
===
MSG: unitree_go/BmsState
uint8 version_high
uint8 version_low
uint8 status
uint8 soc
int32 current
uint16 cycle
int8[2] bq_ntc
int8[2] mcu_ntc
uint16[15] cell_vol
";

/// Definition of a type, if known.
pub(super) fn text(message: &str) -> Option<&'static str> {
    let (_, text) = KNOWN.iter().find(|(name, _)| *name == message)?;
    Some(text)
}
