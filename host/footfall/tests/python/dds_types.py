"""Messages of ROS 2 for CycloneDDS, written from their definitions without footfall's own encoding."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int8, int16, int32, sequence, uint8, uint16, uint32


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Contact(IdlStruct, typename="footfall_msgs::msg::dds_::Contact_"):
    header: Header
    foot: str
    node: uint8
    p_stable: float32
    p_tangential: float32
    p_vertical: float32
    p_axes: array[float32, 6]
    decision: bool
    state: uint8
    valid: bool
    flags: uint8
    sequence: uint16


@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class TwistWithCovarianceStamped(
    IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovarianceStamped_"
):
    header: Header
    twist: TwistWithCovariance


@dataclass
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class ContactsStamped(IdlStruct, typename="champ_msgs::msg::dds_::ContactsStamped_"):
    header: Header
    contacts: sequence[bool]


@dataclass
class QuadrupedStance(IdlStruct, typename="pronto_msgs::msg::dds_::QuadrupedStance_"):
    header: Header
    lf: float32
    rf: float32
    lh: float32
    rh: float32


# Discovery message about nodes, since ROS 2 Iron.
@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(
    IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


@dataclass
class Float64MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float64MultiArray_"):
    @dataclass
    class Layout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
        @dataclass
        class Dimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
            label: str
            size: uint32
            stride: uint32

        dim: sequence[Dimension]
        data_offset: uint32

    layout: Layout
    data: sequence[float64]


@dataclass
class ContactDetection(IdlStruct, typename="state_estimator_msgs::msg::dds_::ContactDetection_"):
    header: Header
    stance_lf: bool
    stance_rf: bool
    stance_lh: bool
    stance_rh: bool


# The state of a Go2, and of a GO1 that speaks ROS 2 (unitree_go).
@dataclass
class ImuState(IdlStruct, typename="unitree_go::msg::dds_::IMUState_"):
    quaternion: array[float32, 4]
    gyroscope: array[float32, 3]
    accelerometer: array[float32, 3]
    rpy: array[float32, 3]
    temperature: int8


@dataclass
class MotorState(IdlStruct, typename="unitree_go::msg::dds_::MotorState_"):
    mode: uint8
    q: float32
    dq: float32
    ddq: float32
    tau_est: float32
    q_raw: float32
    dq_raw: float32
    ddq_raw: float32
    temperature: int8
    lost: uint32
    reserve: array[uint32, 2]


@dataclass
class BmsState(IdlStruct, typename="unitree_go::msg::dds_::BmsState_"):
    version_high: uint8
    version_low: uint8
    status: uint8
    soc: uint8
    current: int32
    cycle: uint16
    bq_ntc: array[int8, 2]
    mcu_ntc: array[int8, 2]
    cell_vol: array[uint16, 15]


@dataclass
class LowState(IdlStruct, typename="unitree_go::msg::dds_::LowState_"):
    head: array[uint8, 2]
    level_flag: uint8
    frame_reserve: uint8
    sn: array[uint32, 2]
    version: array[uint32, 2]
    bandwidth: uint16
    imu_state: ImuState
    motor_state: array[MotorState, 20]
    bms_state: BmsState
    foot_force: array[int16, 4]
    foot_force_est: array[int16, 4]
    tick: uint32
    wireless_remote: array[uint8, 40]
    bit_flag: uint8
    adc_reel: float32
    temperature_ntc1: int8
    temperature_ntc2: int8
    power_v: float32
    power_a: float32
    fan_frequency: array[uint16, 4]
    reserve: uint32
    crc: uint32
