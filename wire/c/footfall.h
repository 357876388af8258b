/*
 * Decoder of the messages that a foot of footfall sends on CAN and on its serial line: C11 and C++17,
 * without allocation and global state.
 *
 *     struct footfall_frame frame;
 *     if (footfall_decode(can_id, data, length, &frame) == FOOTFALL_OK
 *         && frame.kind == FOOTFALL_FRAME_KIND_CONTACT && frame.content.contact.status.valid)
 *         use(frame.node, frame.content.contact.stable_contact_probability);
 *
 * Units are in the names: `_us` microseconds, `_m_s2` m/s^2, `_rad_s` rad/s, `_deg_c` degrees
 * Celsius. A quantity that the foot does not know is NaN. Probabilities are 0 to 1.
 *
 * README.md of the crate `wire` describes the formats; tests/c compares this decoder with the crate's.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef FOOTFALL_H
#define FOOTFALL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Result of decoding. */
enum footfall_result {
    FOOTFALL_OK = 0,
    /* CAN: no frame of a foot has this identifier. */
    FOOTFALL_UNKNOWN_ID,
    /* CAN: the frame has the wrong length. */
    FOOTFALL_WRONG_LENGTH,
    /* CAN: a value is invalid, such as an unknown state or a load that is NaN. */
    FOOTFALL_WRONG_VALUE,
    /* Serial line: the byte does not end a frame. */
    FOOTFALL_INCOMPLETE,
    /* Serial line: the frame ended too early: bytes were lost, or it is garbage. */
    FOOTFALL_WRONG_CODING,
    /* Serial line: no end within the longest frame. */
    FOOTFALL_TOO_LONG,
    /* Serial line: too few bytes for a frame. */
    FOOTFALL_TOO_SHORT,
    /* Serial line: the CRC does not match. */
    FOOTFALL_WRONG_CHECK,
    /* Serial line: unknown version of the format. */
    FOOTFALL_UNKNOWN_VERSION,
    /* Serial line: unknown type of message. */
    FOOTFALL_UNKNOWN_TYPE,
    /* Serial line: invalid payload of a known type. */
    FOOTFALL_WRONG_PAYLOAD
};

/* Phase of the gait; unknown without a load signal or in doubt. */
enum footfall_state {
    FOOTFALL_STATE_UNKNOWN = 0,
    FOOTFALL_STATE_STANCE = 1,
    FOOTFALL_STATE_SLIP = 2,
    FOOTFALL_STATE_SWING = 3,
    FOOTFALL_STATE_QUIET_SWING = 4,
    FOOTFALL_STATE_LANDING = 5
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_state_name(enum footfall_state state);

/* Debounced decision; stable only if the status is valid. */
enum footfall_decision {
    FOOTFALL_DECISION_NOT_STABLE = 0,
    FOOTFALL_DECISION_STABLE = 1
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_decision_name(enum footfall_decision decision);

/* State of the node (NMT), as in the heartbeat; a boot-up is the first of these states. */
enum footfall_node_state {
    FOOTFALL_NODE_STATE_BOOT_UP = 0,
    FOOTFALL_NODE_STATE_STOPPED = 4,
    FOOTFALL_NODE_STATE_OPERATIONAL = 5,
    FOOTFALL_NODE_STATE_PRE_OPERATIONAL = 127
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_node_state_name(enum footfall_node_state node_state);

/* Stage of the board. */
enum footfall_stage {
    FOOTFALL_STAGE_STARTING = 0,
    FOOTFALL_STAGE_SELF_TEST = 1,
    FOOTFALL_STAGE_HOLD_STILL = 2,
    FOOTFALL_STAGE_RUNNING = 3,
    FOOTFALL_STAGE_RECOVERING = 4
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_stage_name(enum footfall_stage stage);

/* Fault of the board. Bit i of a set of faults is the fault of number i. */
enum footfall_fault {
    FOOTFALL_FAULT_SENSOR_SILENT = 0,
    FOOTFALL_FAULT_SENSOR_FROZEN = 1,
    FOOTFALL_FAULT_SENSOR_WRONG_ID = 2,
    FOOTFALL_FAULT_SENSOR_RESET = 3,
    FOOTFALL_FAULT_SENSOR_CONFIG_MISMATCH = 4,
    FOOTFALL_FAULT_SENSOR_SATURATED = 5,
    FOOTFALL_FAULT_SENSOR_TIMING = 6,
    FOOTFALL_FAULT_SENSOR_SELF_TEST = 7,
    FOOTFALL_FAULT_LOAD_SENSOR_OPEN = 8,
    FOOTFALL_FAULT_CRYSTAL_MISSING = 9,
    FOOTFALL_FAULT_CONFIG_CORRUPTED = 10,
    FOOTFALL_FAULT_CONFIG_STORE = 11,
    FOOTFALL_FAULT_PANIC = 12,
    FOOTFALL_FAULT_HARD_FAULT = 13,
    FOOTFALL_FAULT_WATCHDOG_RESET = 14,
    FOOTFALL_FAULT_LATE_TICK = 15,
    FOOTFALL_FAULT_CAN_OVERRUN = 16,
    FOOTFALL_FAULT_CAN_ERROR_PASSIVE = 17,
    FOOTFALL_FAULT_CAN_BUS_OFF = 18,
    FOOTFALL_FAULT_PDO_LENGTH = 19,
    FOOTFALL_FAULT_UART_OVERRUN = 20,
    FOOTFALL_FAULT_PDO_TIMEOUT = 21,
    FOOTFALL_FAULT_GYRO_BIAS = 22,
    FOOTFALL_FAULT_SENSOR_SCALE = 23,
    FOOTFALL_FAULT_MISREAD = 24,
    FOOTFALL_FAULT_DATA_READY_DEAD = 25,
    FOOTFALL_FAULT_UNKNOWN = 255
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_fault_name(enum footfall_fault fault);

/* Validity of a sample, reported by the sensor's driver. */
enum footfall_validity {
    FOOTFALL_VALIDITY_VALID = 0,
    FOOTFALL_VALIDITY_ACCELEROMETER_SATURATED = 1,
    FOOTFALL_VALIDITY_GYROSCOPE_SATURATED = 2,
    FOOTFALL_VALIDITY_SATURATED = 3,
    FOOTFALL_VALIDITY_STALE = 4,
    FOOTFALL_VALIDITY_INVALID = 5
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_validity_name(enum footfall_validity validity);

/* Reason why a request was refused (CiA 301). */
enum footfall_abort {
    FOOTFALL_ABORT_TOGGLE_BIT = 0x05030000,
    FOOTFALL_ABORT_COMMAND = 0x05040001,
    FOOTFALL_ABORT_SEQUENCE_NUMBER = 0x05040003,
    FOOTFALL_ABORT_CRC = 0x05040004,
    FOOTFALL_ABORT_WRITE_ONLY = 0x06010001,
    FOOTFALL_ABORT_READ_ONLY = 0x06010002,
    FOOTFALL_ABORT_NO_OBJECT = 0x06020000,
    FOOTFALL_ABORT_INCOMPATIBLE = 0x06040043,
    FOOTFALL_ABORT_HARDWARE = 0x06060000,
    FOOTFALL_ABORT_LENGTH = 0x06070010,
    FOOTFALL_ABORT_TOO_LONG = 0x06070012,
    FOOTFALL_ABORT_TOO_SHORT = 0x06070013,
    FOOTFALL_ABORT_NO_SUBINDEX = 0x06090011,
    FOOTFALL_ABORT_INVALID_VALUE = 0x06090030,
    FOOTFALL_ABORT_TOO_HIGH = 0x06090031,
    FOOTFALL_ABORT_TOO_LOW = 0x06090032,
    FOOTFALL_ABORT_CANNOT_STORE = 0x08000020,
    FOOTFALL_ABORT_LOCKED = 0x08000021,
    FOOTFALL_ABORT_DEVICE_STATE = 0x08000022,
    FOOTFALL_ABORT_TOO_SOON = 0x08000000
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_abort_name(enum footfall_abort abort);

/* A change of the node's state (NMT). */
enum footfall_command {
    FOOTFALL_COMMAND_START = 1,
    FOOTFALL_COMMAND_STOP = 2,
    FOOTFALL_COMMAND_ENTER_PRE_OPERATIONAL = 128,
    FOOTFALL_COMMAND_RESET_NODE = 129,
    FOOTFALL_COMMAND_RESET_COMMUNICATION = 130
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_command_name(enum footfall_command command);

/* Kind of a CAN frame. */
enum footfall_frame_kind {
    FOOTFALL_FRAME_KIND_CONTACT = 0,
    FOOTFALL_FRAME_KIND_AXES = 1,
    FOOTFALL_FRAME_KIND_ATTITUDE = 2,
    FOOTFALL_FRAME_KIND_ACCELERATION = 3,
    FOOTFALL_FRAME_KIND_RATE = 4,
    FOOTFALL_FRAME_KIND_BIAS = 5,
    FOOTFALL_FRAME_KIND_HEALTH = 6,
    FOOTFALL_FRAME_KIND_EMERGENCY = 7,
    FOOTFALL_FRAME_KIND_HEARTBEAT = 8,
    FOOTFALL_FRAME_KIND_LOAD = 9
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_frame_kind_name(enum footfall_frame_kind frame_kind);

/* Kind of a message of the serial line: the byte of its type. */
enum footfall_message_kind {
    FOOTFALL_MESSAGE_KIND_CONTACT = 1,
    FOOTFALL_MESSAGE_KIND_RAW = 2,
    FOOTFALL_MESSAGE_KIND_HEALTH = 3,
    FOOTFALL_MESSAGE_KIND_CONFIG_GET = 16,
    FOOTFALL_MESSAGE_KIND_CONFIG_SET = 17,
    FOOTFALL_MESSAGE_KIND_CONFIG_RESPONSE = 18,
    FOOTFALL_MESSAGE_KIND_LOG = 32,
    FOOTFALL_MESSAGE_KIND_NMT = 19
};

/* Returns its name; "unknown" for any other number. */
const char *footfall_message_kind_name(enum footfall_message_kind message_kind);

/* Returns the code of `fault` in emergency messages; 0 for FOOTFALL_FAULT_UNKNOWN. */
uint16_t footfall_fault_code(enum footfall_fault fault);

/* Returns the meaning of the detail of its emergency message. */
const char *footfall_fault_detail(enum footfall_fault fault);

/* Phase, decision and their validity. */
struct footfall_status {
    /* Phase of the gait; unknown without a load signal or in doubt. */
    enum footfall_state state;
    /* Debounced decision; stable only if Valid is yes. */
    enum footfall_decision decision;
    /* No fault, and no flag other than a time gap or settling. */
    bool valid;
    /* The newest sample is at the end of the sensor's range. */
    bool saturated;
    /* The sensor cannot be trusted; the EMCY message has the reason. */
    bool fault;
    /* The window is not full, or up is not yet known. */
    bool starting;
};

/* Reasons to doubt the estimate. */
struct footfall_flags {
    /* Fewer samples than the window holds. */
    bool window_not_full;
    /* Up is not yet known. */
    bool attitude_not_initialised;
    /* The newest sample is at the end of the sensor's range. */
    bool sample_saturated;
    /* The newest sample repeats an earlier one. */
    bool stale;
    /* The newest sample cannot be used. */
    bool invalid_sample;
    /* More than 1.75 periods since the previous sample: one or more are missing. */
    bool time_gap;
    /* The foot has not learnt enough of its stances and swings yet; a few steps suffice. */
    bool settling;
    /* The foot hardly moves, but has neither rested nor landed for a stride. */
    bool unproven;
};

/* TPDO1: contact, each tick. */
struct footfall_contact {
    /* Probability that the foot is in stable contact. 0 with a fault. */
    float stable_contact_probability;
    /* Probability of no motion along the ground. 0 with a fault. */
    float tangential_probability;
    /* Probability of no lifting and no tilting. 0 with a fault. */
    float vertical_probability;
    /* Acquisition time of the sample on the foot's clock; wraps every 655.36 ms. */
    uint32_t timestamp_us;
    /* Incremented with each frame, sent or dropped; wraps after 255. */
    uint8_t sequence;
    /* Phase, decision and their validity. */
    struct footfall_status status;
};

/* TPDO2: probability of each axis. */
struct footfall_axes {
    /* Probability that the axis rests. 0 with a fault. */
    float probability_ax;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_ay;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_az;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wx;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wy;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wz;
    /* Acquisition time of the sample on the foot's clock; wraps every 655.36 ms. */
    uint32_t timestamp_us;
};

/* TPDO3: orientation. */
struct footfall_attitude {
    /* Orientation quaternion (Hamilton), foot to world, z up, heading arbitrary; of the same
     * sample as the previous Contact message. */
    float quaternion_w;
    /* Orientation quaternion (Hamilton), foot to world, z up, heading arbitrary; of the same
     * sample as the previous Contact message. */
    float quaternion_x;
    /* Orientation quaternion (Hamilton), foot to world, z up, heading arbitrary; of the same
     * sample as the previous Contact message. */
    float quaternion_y;
    /* Orientation quaternion (Hamilton), foot to world, z up, heading arbitrary; of the same
     * sample as the previous Contact message. */
    float quaternion_z;
};

/* TPDO4: acceleration without gravity. */
struct footfall_acceleration {
    /* Acceleration without gravity, frame of the foot. */
    float acceleration_x_m_s2;
    /* Acceleration without gravity, frame of the foot. */
    float acceleration_y_m_s2;
    /* Acceleration without gravity, frame of the foot. */
    float acceleration_z_m_s2;
    /* Acquisition time of the sample on the foot's clock; wraps every 655.36 ms. */
    uint32_t timestamp_us;
};

/* TPDO5: angular rate without bias. */
struct footfall_rate {
    /* Angular rate without bias, frame of the foot. */
    float rate_x_rad_s;
    /* Angular rate without bias, frame of the foot. */
    float rate_y_rad_s;
    /* Angular rate without bias, frame of the foot. */
    float rate_z_rad_s;
    /* Acquisition time of the sample on the foot's clock; wraps every 655.36 ms. */
    uint32_t timestamp_us;
};

/* TPDO6: gyroscope bias and temperature. */
struct footfall_bias {
    /* Estimated bias of the gyroscope, frame of the foot. */
    float bias_x_rad_s;
    /* Estimated bias of the gyroscope, frame of the foot. */
    float bias_y_rad_s;
    /* Estimated bias of the gyroscope, frame of the foot. */
    float bias_z_rad_s;
    /* Temperature of the sensor. */
    float temperature_deg_c;
};

/* TPDO7: flags, errors, drops and the clock. */
struct footfall_health {
    /* Reasons to doubt the estimate. */
    struct footfall_flags flags;
    /* Object 0x1001 of CiA 301. */
    uint8_t error_register;
    /* Frames replaced by newer ones before they were sent on CAN or UART; wraps after 255. */
    uint8_t dropped;
    /* When Clock was read: at the SYNC with this counter, at most 200 ms ago; 0: at the sample of
     * the previous contact. */
    uint8_t sync_counter;
    /* The foot's clock at the moment given by SyncCounter. Modulo 655.36 ms it is a Timestamp. */
    uint64_t clock_us;
};

/* The contact, at full resolution, each tick. */
struct footfall_serial_contact {
    /* Acquisition time of the sample on the foot's clock. */
    uint64_t timestamp_us;
    /* Probability that the foot is in stable contact. 0 with a fault. */
    float stable_contact_probability;
    /* Probability of no motion along the ground. 0 with a fault. */
    float tangential_probability;
    /* Probability of no lifting and no tilting. 0 with a fault. */
    float vertical_probability;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_ax;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_ay;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_az;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wx;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wy;
    /* Probability that the axis rests. 0 with a fault. */
    float probability_wz;
    /* As on CAN. */
    struct footfall_status status;
    /* As on CAN. */
    struct footfall_flags flags;
};

/* Measurement of the sensor. */
struct footfall_serial_raw {
    /* Acquisition time of the sample on the foot's clock. */
    uint64_t timestamp_us;
    /* Validity reported by the driver. */
    enum footfall_validity validity;
    /* Temperature of the sensor. */
    float temperature_deg_c;
    /* Code of the sensor. */
    int16_t accelerometer_x_code;
    /* Code times scale, frame of the sensor. */
    float specific_force_x_m_s2;
    /* Code of the sensor. */
    int16_t accelerometer_y_code;
    /* Code times scale, frame of the sensor. */
    float specific_force_y_m_s2;
    /* Code of the sensor. */
    int16_t accelerometer_z_code;
    /* Code times scale, frame of the sensor. */
    float specific_force_z_m_s2;
    /* Code of the sensor. */
    int16_t gyroscope_x_code;
    /* Code times scale, frame of the sensor. */
    float angular_rate_x_rad_s;
    /* Code of the sensor. */
    int16_t gyroscope_y_code;
    /* Code times scale, frame of the sensor. */
    float angular_rate_y_rad_s;
    /* Code of the sensor. */
    int16_t gyroscope_z_code;
    /* Code times scale, frame of the sensor. */
    float angular_rate_z_rad_s;
    float accelerometer_m_s2_per_code;
    float gyroscope_rad_s_per_code;
};

/* State of the board; counters since power-up. */
struct footfall_serial_health {
    /* The board's clock. */
    uint64_t timestamp_us;
    /* Stage of the board. */
    enum footfall_stage stage;
    /* State of the node. */
    enum footfall_node_state node_state;
    /* 1 to 127; 0: none yet. */
    uint8_t node;
    /* Active faults: bit i is the fault of number i; an unknown one belongs to a newer
     * version. */
    uint32_t faults;
    /* Temperature of the sensor. */
    float temperature_deg_c;
    uint32_t ticks;
    uint32_t valid_samples;
    uint32_t saturated_samples;
    uint32_t missed_samples;
    uint32_t sensor_restarts;
    uint32_t can_dropped;
    uint32_t can_bus_off;
    uint32_t uart_dropped;
    uint32_t uart_refused;
    uint32_t uart_overruns;
    uint32_t late_ticks;
};

/* A fault was raised or cleared. */
struct footfall_emergency {
    /* Emergency code; 0 if the fault was cleared. */
    uint16_t code;
    /* Object 0x1001 of CiA 301 after the change. */
    uint8_t error_register;
    /* FOOTFALL_FAULT_UNKNOWN: no fault has this number, or its code differs. */
    enum footfall_fault fault;
    /* Detail, with the meaning given by footfall_fault_detail. */
    uint32_t detail;
};

/* Boot-up or heartbeat of the node. */
struct footfall_heartbeat {
    enum footfall_node_state state;
};

/* RPDO1: the load on the foot, from the robot. */
struct footfall_load {
    /* In the unit of the load thresholds. */
    float load;
};

/* A CAN frame: `kind` selects the member of `content`. */
struct footfall_frame {
    /* 1 to 127. */
    uint8_t node;
    enum footfall_frame_kind kind;
    union {
        struct footfall_contact contact;
        struct footfall_axes axes;
        struct footfall_attitude attitude;
        struct footfall_acceleration acceleration;
        struct footfall_rate rate;
        struct footfall_bias bias;
        struct footfall_health health;
        struct footfall_emergency emergency;
        struct footfall_heartbeat heartbeat;
        struct footfall_load load;
    } content;
};

/*
 * Decodes a CAN frame: identifier of 11 bits, data, number of bytes. Read `out` only after
 * FOOTFALL_OK. Identifiers with more bits, by which SocketCAN marks extended, remote and error
 * frames, give FOOTFALL_UNKNOWN_ID. `data` may be NULL if `length` is 0.
 */
enum footfall_result footfall_decode(uint32_t cob_id, const uint8_t *data, size_t length,
                                     struct footfall_frame *out);

/* Address of an object of the dictionary (CiA 301). */
struct footfall_address {
    uint16_t index;
    uint8_t subindex;
};

/* The longest value of an object, bytes. */
#define FOOTFALL_MAX_VALUE 32
/* Bytes of a value of an object, as many as its type has. */
struct footfall_value {
    uint8_t bytes[FOOTFALL_MAX_VALUE];
    uint8_t length;
};

/* Request for an object's value. */
struct footfall_serial_get {
    struct footfall_address address;
};

/* Request to change an object's value. */
struct footfall_serial_set {
    struct footfall_address address;
    struct footfall_value value;
};

/* Result of a request. */
enum footfall_answer {
    FOOTFALL_ANSWER_DONE = 0,
    FOOTFALL_ANSWER_VALUE = 1,
    FOOTFALL_ANSWER_REFUSED = 2
};

/* Response to either request. */
struct footfall_serial_response {
    struct footfall_address address;
    enum footfall_answer answer;
    /* With FOOTFALL_ANSWER_VALUE. */
    struct footfall_value value;
    /* With FOOTFALL_ANSWER_REFUSED. */
    enum footfall_abort reason;
};

/* Request to change the NMT state. */
struct footfall_serial_nmt {
    enum footfall_command command;
};

/* The longest line of text, bytes. */
#define FOOTFALL_MAX_LOG 120
/* A line of text. */
struct footfall_serial_log {
    /* 1 error, 2 warning, 3 information. */
    uint8_t level;
    /* Bytes of the text. */
    uint8_t length;
    /* UTF-8, with a zero at the end. */
    char text[FOOTFALL_MAX_LOG + 1];
};

/* A message of the serial line: `kind` selects the member of `content`. */
struct footfall_message {
    /* Incremented with each frame, sent or dropped; wraps after 65535. A contact overtakes others. */
    uint16_t sequence;
    enum footfall_message_kind kind;
    union {
        struct footfall_serial_contact contact;
        struct footfall_serial_raw raw;
        struct footfall_serial_health health;
        struct footfall_serial_get get;
        struct footfall_serial_set set;
        struct footfall_serial_response response;
        struct footfall_serial_log log;
        struct footfall_serial_nmt nmt;
    } content;
};

/* Maximum length of a frame before coding, bytes. */
#define FOOTFALL_MAX_DECODED 136
/* State of the decoder of the serial line. Its members are private. Start with all bytes zero. */
struct footfall_stream {
    uint8_t plain[FOOTFALL_MAX_DECODED];
    size_t length;
    uint8_t left;
    bool zero_due;
    bool overflowed;
};

/* Resets the decoder to its initial state. */
void footfall_stream_init(struct footfall_stream *stream);

/*
 * Takes the next byte of the serial line. Read `out` only after FOOTFALL_OK, which the last
 * byte of a frame gives. After any other bytes the next complete frame is found.
 */
enum footfall_result footfall_stream_push(struct footfall_stream *stream, uint8_t byte,
                                          struct footfall_message *out);

#ifdef __cplusplus
}
#endif

#endif
