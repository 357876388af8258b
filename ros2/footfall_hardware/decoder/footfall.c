/*
 * The decoder of footfall.h.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "footfall.h"

#include <assert.h>
#include <string.h>

static_assert(sizeof(float) == 4, "REAL32 is the float of IEEE 754");

/* Little-endian numbers at any address, whatever the byte order of the machine. */

static uint16_t u16_at(const uint8_t *data)
{
    return (uint16_t)(data[0] | (uint32_t)data[1] << 8);
}

static uint32_t u32_at(const uint8_t *data)
{
    return (uint32_t)u16_at(data) | (uint32_t)u16_at(data + 2) << 16;
}

static uint64_t u64_at(const uint8_t *data)
{
    return (uint64_t)u32_at(data) | (uint64_t)u32_at(data + 4) << 32;
}

static int16_t i16_at(const uint8_t *data)
{
    const int32_t code = u16_at(data);
    return (int16_t)(code < 0x8000 ? code : code - 0x10000);
}

static float f32_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float f32_at(const uint8_t *data)
{
    return f32_of(u32_at(data));
}

/* A code times a step; the lowest code has no value. */
static float quantity(int16_t code, float step)
{
    return code == INT16_MIN ? f32_of(UINT32_C(0x7FC00000)) : (float)code * step;
}

const char *footfall_state_name(enum footfall_state state)
{
    switch (state) {
    case FOOTFALL_STATE_UNKNOWN:
        return "unknown";
    case FOOTFALL_STATE_STANCE:
        return "stance";
    case FOOTFALL_STATE_SLIP:
        return "slip";
    case FOOTFALL_STATE_SWING:
        return "swing";
    case FOOTFALL_STATE_QUIET_SWING:
        return "quiet_swing";
    case FOOTFALL_STATE_LANDING:
        return "landing";
    }
    return "unknown";
}

static bool is_state(uint32_t code)
{
    switch (code) {
    case 0u:
    case 1u:
    case 2u:
    case 3u:
    case 4u:
    case 5u:
        return true;
    default:
        return false;
    }
}

const char *footfall_decision_name(enum footfall_decision decision)
{
    switch (decision) {
    case FOOTFALL_DECISION_NOT_STABLE:
        return "not_stable";
    case FOOTFALL_DECISION_STABLE:
        return "stable";
    }
    return "unknown";
}

const char *footfall_node_state_name(enum footfall_node_state node_state)
{
    switch (node_state) {
    case FOOTFALL_NODE_STATE_BOOT_UP:
        return "boot_up";
    case FOOTFALL_NODE_STATE_STOPPED:
        return "stopped";
    case FOOTFALL_NODE_STATE_OPERATIONAL:
        return "operational";
    case FOOTFALL_NODE_STATE_PRE_OPERATIONAL:
        return "pre_operational";
    }
    return "unknown";
}

static bool is_node_state(uint32_t code)
{
    switch (code) {
    case 0u:
    case 4u:
    case 5u:
    case 127u:
        return true;
    default:
        return false;
    }
}

const char *footfall_stage_name(enum footfall_stage stage)
{
    switch (stage) {
    case FOOTFALL_STAGE_STARTING:
        return "starting";
    case FOOTFALL_STAGE_SELF_TEST:
        return "self_test";
    case FOOTFALL_STAGE_HOLD_STILL:
        return "hold_still";
    case FOOTFALL_STAGE_RUNNING:
        return "running";
    case FOOTFALL_STAGE_RECOVERING:
        return "recovering";
    }
    return "unknown";
}

static bool is_stage(uint32_t code)
{
    switch (code) {
    case 0u:
    case 1u:
    case 2u:
    case 3u:
    case 4u:
        return true;
    default:
        return false;
    }
}

const char *footfall_fault_name(enum footfall_fault fault)
{
    switch (fault) {
    case FOOTFALL_FAULT_SENSOR_SILENT:
        return "sensor silent";
    case FOOTFALL_FAULT_SENSOR_FROZEN:
        return "sensor frozen";
    case FOOTFALL_FAULT_SENSOR_WRONG_ID:
        return "sensor has a wrong WHO_AM_I";
    case FOOTFALL_FAULT_SENSOR_RESET:
        return "sensor was reset";
    case FOOTFALL_FAULT_SENSOR_CONFIG_MISMATCH:
        return "sensor register does not read back";
    case FOOTFALL_FAULT_SENSOR_SATURATED:
        return "sensor saturated for long";
    case FOOTFALL_FAULT_SENSOR_TIMING:
        return "sensor out of step";
    case FOOTFALL_FAULT_SENSOR_SELF_TEST:
        return "sensor self-test failed";
    case FOOTFALL_FAULT_LOAD_SENSOR_OPEN:
        return "load sensor open";
    case FOOTFALL_FAULT_CRYSTAL_MISSING:
        return "crystal missing";
    case FOOTFALL_FAULT_CONFIG_CORRUPTED:
        return "stored configuration unreadable";
    case FOOTFALL_FAULT_CONFIG_STORE:
        return "configuration not stored";
    case FOOTFALL_FAULT_PANIC:
        return "program panicked";
    case FOOTFALL_FAULT_HARD_FAULT:
        return "processor fault";
    case FOOTFALL_FAULT_WATCHDOG_RESET:
        return "watchdog reset";
    case FOOTFALL_FAULT_LATE_TICK:
        return "tick too long";
    case FOOTFALL_FAULT_CAN_OVERRUN:
        return "CAN overrun";
    case FOOTFALL_FAULT_CAN_ERROR_PASSIVE:
        return "CAN error-passive";
    case FOOTFALL_FAULT_CAN_BUS_OFF:
        return "CAN bus-off";
    case FOOTFALL_FAULT_PDO_LENGTH:
        return "received PDO has a wrong length";
    case FOOTFALL_FAULT_UART_OVERRUN:
        return "UART overrun";
    case FOOTFALL_FAULT_PDO_TIMEOUT:
        return "received PDO timed out";
    case FOOTFALL_FAULT_GYRO_BIAS:
        return "gyroscope bias too large";
    case FOOTFALL_FAULT_SENSOR_SCALE:
        return "sensor has a wrong scale";
    case FOOTFALL_FAULT_MISREAD:
        return "misread on the sensor's bus";
    case FOOTFALL_FAULT_DATA_READY_DEAD:
        return "data-ready line dead";
    case FOOTFALL_FAULT_UNKNOWN:
        break;
    }
    return "unknown";
}

static bool is_fault(uint32_t code)
{
    switch (code) {
    case 0u:
    case 1u:
    case 2u:
    case 3u:
    case 4u:
    case 5u:
    case 6u:
    case 7u:
    case 8u:
    case 9u:
    case 10u:
    case 11u:
    case 12u:
    case 13u:
    case 14u:
    case 15u:
    case 16u:
    case 17u:
    case 18u:
    case 19u:
    case 20u:
    case 21u:
    case 22u:
    case 23u:
    case 24u:
    case 25u:
        return true;
    default:
        return false;
    }
}

const char *footfall_validity_name(enum footfall_validity validity)
{
    switch (validity) {
    case FOOTFALL_VALIDITY_VALID:
        return "valid";
    case FOOTFALL_VALIDITY_ACCELEROMETER_SATURATED:
        return "accelerometer_saturated";
    case FOOTFALL_VALIDITY_GYROSCOPE_SATURATED:
        return "gyroscope_saturated";
    case FOOTFALL_VALIDITY_SATURATED:
        return "saturated";
    case FOOTFALL_VALIDITY_STALE:
        return "stale";
    case FOOTFALL_VALIDITY_INVALID:
        return "invalid";
    }
    return "unknown";
}

static bool is_validity(uint32_t code)
{
    switch (code) {
    case 0u:
    case 1u:
    case 2u:
    case 3u:
    case 4u:
    case 5u:
        return true;
    default:
        return false;
    }
}

const char *footfall_abort_name(enum footfall_abort abort)
{
    switch (abort) {
    case FOOTFALL_ABORT_TOGGLE_BIT:
        return "toggle bit not alternated";
    case FOOTFALL_ABORT_COMMAND:
        return "command specifier not valid";
    case FOOTFALL_ABORT_SEQUENCE_NUMBER:
        return "sequence number not valid";
    case FOOTFALL_ABORT_CRC:
        return "CRC error";
    case FOOTFALL_ABORT_WRITE_ONLY:
        return "write-only object";
    case FOOTFALL_ABORT_READ_ONLY:
        return "read-only object";
    case FOOTFALL_ABORT_NO_OBJECT:
        return "no such object";
    case FOOTFALL_ABORT_INCOMPATIBLE:
        return "does not go together with the other settings";
    case FOOTFALL_ABORT_HARDWARE:
        return "hardware error";
    case FOOTFALL_ABORT_LENGTH:
        return "length does not fit the type";
    case FOOTFALL_ABORT_TOO_LONG:
        return "value too long";
    case FOOTFALL_ABORT_TOO_SHORT:
        return "value too short";
    case FOOTFALL_ABORT_NO_SUBINDEX:
        return "no such sub-index";
    case FOOTFALL_ABORT_INVALID_VALUE:
        return "value not allowed";
    case FOOTFALL_ABORT_TOO_HIGH:
        return "value too high";
    case FOOTFALL_ABORT_TOO_LOW:
        return "value too low";
    case FOOTFALL_ABORT_CANNOT_STORE:
        return "cannot be stored: wrong signature";
    case FOOTFALL_ABORT_LOCKED:
        return "configuration is locked";
    case FOOTFALL_ABORT_DEVICE_STATE:
        return "only in pre-operational state";
    case FOOTFALL_ABORT_TOO_SOON:
        return "too many stores: one a second";
    }
    return "unknown";
}

static bool is_abort(uint32_t code)
{
    switch (code) {
    case 0x05030000u:
    case 0x05040001u:
    case 0x05040003u:
    case 0x05040004u:
    case 0x06010001u:
    case 0x06010002u:
    case 0x06020000u:
    case 0x06040043u:
    case 0x06060000u:
    case 0x06070010u:
    case 0x06070012u:
    case 0x06070013u:
    case 0x06090011u:
    case 0x06090030u:
    case 0x06090031u:
    case 0x06090032u:
    case 0x08000020u:
    case 0x08000021u:
    case 0x08000022u:
    case 0x08000000u:
        return true;
    default:
        return false;
    }
}

const char *footfall_command_name(enum footfall_command command)
{
    switch (command) {
    case FOOTFALL_COMMAND_START:
        return "start";
    case FOOTFALL_COMMAND_STOP:
        return "stop";
    case FOOTFALL_COMMAND_ENTER_PRE_OPERATIONAL:
        return "enter_pre_operational";
    case FOOTFALL_COMMAND_RESET_NODE:
        return "reset_node";
    case FOOTFALL_COMMAND_RESET_COMMUNICATION:
        return "reset_communication";
    }
    return "unknown";
}

static bool is_command(uint32_t code)
{
    switch (code) {
    case 1u:
    case 2u:
    case 128u:
    case 129u:
    case 130u:
        return true;
    default:
        return false;
    }
}

const char *footfall_frame_kind_name(enum footfall_frame_kind frame_kind)
{
    switch (frame_kind) {
    case FOOTFALL_FRAME_KIND_CONTACT:
        return "contact";
    case FOOTFALL_FRAME_KIND_AXES:
        return "axes";
    case FOOTFALL_FRAME_KIND_ATTITUDE:
        return "attitude";
    case FOOTFALL_FRAME_KIND_ACCELERATION:
        return "acceleration";
    case FOOTFALL_FRAME_KIND_RATE:
        return "rate";
    case FOOTFALL_FRAME_KIND_BIAS:
        return "bias";
    case FOOTFALL_FRAME_KIND_HEALTH:
        return "health";
    case FOOTFALL_FRAME_KIND_EMERGENCY:
        return "emergency";
    case FOOTFALL_FRAME_KIND_HEARTBEAT:
        return "heartbeat";
    case FOOTFALL_FRAME_KIND_LOAD:
        return "load";
    }
    return "unknown";
}

const char *footfall_message_kind_name(enum footfall_message_kind message_kind)
{
    switch (message_kind) {
    case FOOTFALL_MESSAGE_KIND_CONTACT:
        return "contact";
    case FOOTFALL_MESSAGE_KIND_RAW:
        return "raw";
    case FOOTFALL_MESSAGE_KIND_HEALTH:
        return "health";
    case FOOTFALL_MESSAGE_KIND_CONFIG_GET:
        return "config_get";
    case FOOTFALL_MESSAGE_KIND_CONFIG_SET:
        return "config_set";
    case FOOTFALL_MESSAGE_KIND_CONFIG_RESPONSE:
        return "config_response";
    case FOOTFALL_MESSAGE_KIND_LOG:
        return "log";
    case FOOTFALL_MESSAGE_KIND_NMT:
        return "nmt";
    }
    return "unknown";
}

static bool is_message_kind(uint32_t code)
{
    switch (code) {
    case 1u:
    case 2u:
    case 3u:
    case 16u:
    case 17u:
    case 18u:
    case 32u:
    case 19u:
        return true;
    default:
        return false;
    }
}

uint16_t footfall_fault_code(enum footfall_fault fault)
{
    switch (fault) {
    case FOOTFALL_FAULT_SENSOR_SILENT:
        return 0x7001u;
    case FOOTFALL_FAULT_SENSOR_FROZEN:
        return 0x7002u;
    case FOOTFALL_FAULT_SENSOR_WRONG_ID:
        return 0x7003u;
    case FOOTFALL_FAULT_SENSOR_RESET:
        return 0x7004u;
    case FOOTFALL_FAULT_SENSOR_CONFIG_MISMATCH:
        return 0x7005u;
    case FOOTFALL_FAULT_SENSOR_SATURATED:
        return 0x7006u;
    case FOOTFALL_FAULT_SENSOR_TIMING:
        return 0x7007u;
    case FOOTFALL_FAULT_SENSOR_SELF_TEST:
        return 0x7008u;
    case FOOTFALL_FAULT_LOAD_SENSOR_OPEN:
        return 0x7010u;
    case FOOTFALL_FAULT_CRYSTAL_MISSING:
        return 0x5001u;
    case FOOTFALL_FAULT_CONFIG_CORRUPTED:
        return 0x6300u;
    case FOOTFALL_FAULT_CONFIG_STORE:
        return 0x6301u;
    case FOOTFALL_FAULT_PANIC:
        return 0x6101u;
    case FOOTFALL_FAULT_HARD_FAULT:
        return 0x6102u;
    case FOOTFALL_FAULT_WATCHDOG_RESET:
        return 0x6103u;
    case FOOTFALL_FAULT_LATE_TICK:
        return 0x6104u;
    case FOOTFALL_FAULT_CAN_OVERRUN:
        return 0x8110u;
    case FOOTFALL_FAULT_CAN_ERROR_PASSIVE:
        return 0x8120u;
    case FOOTFALL_FAULT_CAN_BUS_OFF:
        return 0x8140u;
    case FOOTFALL_FAULT_PDO_LENGTH:
        return 0x8210u;
    case FOOTFALL_FAULT_UART_OVERRUN:
        return 0x81F0u;
    case FOOTFALL_FAULT_PDO_TIMEOUT:
        return 0x8250u;
    case FOOTFALL_FAULT_GYRO_BIAS:
        return 0x7009u;
    case FOOTFALL_FAULT_SENSOR_SCALE:
        return 0x700Au;
    case FOOTFALL_FAULT_MISREAD:
        return 0x700Bu;
    case FOOTFALL_FAULT_DATA_READY_DEAD:
        return 0x700Cu;
    case FOOTFALL_FAULT_UNKNOWN:
        break;
    }
    return 0u;
}

const char *footfall_fault_detail(enum footfall_fault fault)
{
    switch (fault) {
    case FOOTFALL_FAULT_SENSOR_SILENT:
        return "duration, us";
    case FOOTFALL_FAULT_SENSOR_FROZEN:
        return "bit i: axis i repeats, in the order ax ay az wx wy wz";
    case FOOTFALL_FAULT_SENSOR_WRONG_ID:
        return "value of WHO_AM_I";
    case FOOTFALL_FAULT_SENSOR_RESET:
        return "samples affected";
    case FOOTFALL_FAULT_SENSOR_CONFIG_MISMATCH:
        return "register, written, read, from the lowest byte";
    case FOOTFALL_FAULT_SENSOR_SATURATED:
        return "samples affected";
    case FOOTFALL_FAULT_SENSOR_TIMING:
        return "samples affected";
    case FOOTFALL_FAULT_SENSOR_SELF_TEST:
        return "bit i: axis i failed, in the order ax ay az wx wy wz";
    case FOOTFALL_FAULT_LOAD_SENSOR_OPEN:
        return "raw reading";
    case FOOTFALL_FAULT_CRYSTAL_MISSING:
        return "frequency of the crystal, kHz; 0 if it does not start";
    case FOOTFALL_FAULT_CONFIG_CORRUPTED:
        return "0 damaged, 1 incompatible values, 2 not read after three consecutive watchdog resets, 3 learnt values of another version or damaged";
    case FOOTFALL_FAULT_CONFIG_STORE:
        return "0 the flash does not read back, 1 the supply is too low";
    case FOOTFALL_FAULT_PANIC:
        return "program counter";
    case FOOTFALL_FAULT_HARD_FAULT:
        return "program counter";
    case FOOTFALL_FAULT_WATCHDOG_RESET:
        return "0";
    case FOOTFALL_FAULT_LATE_TICK:
        return "duration, us";
    case FOOTFALL_FAULT_CAN_OVERRUN:
        return "minimum number of frames or bytes lost so far";
    case FOOTFALL_FAULT_CAN_ERROR_PASSIVE:
        return "receive and transmit error counter, from the lowest byte";
    case FOOTFALL_FAULT_CAN_BUS_OFF:
        return "number so far";
    case FOOTFALL_FAULT_PDO_LENGTH:
        return "bytes received";
    case FOOTFALL_FAULT_UART_OVERRUN:
        return "minimum number of frames or bytes lost so far";
    case FOOTFALL_FAULT_PDO_TIMEOUT:
        return "event timer, ms";
    case FOOTFALL_FAULT_GYRO_BIAS:
        return "angular rate at rest, 0.001 deg/s";
    case FOOTFALL_FAULT_SENSOR_SCALE:
        return "specific force at rest, 0.001 g";
    case FOOTFALL_FAULT_MISREAD:
        return "misreads so far";
    case FOOTFALL_FAULT_DATA_READY_DEAD:
        return "0";
    case FOOTFALL_FAULT_UNKNOWN:
        break;
    }
    return "unknown";
}

/* All known faults. */
static const uint32_t FAULTS_KNOWN = UINT32_C(0x03FFFFFF);

/* Returns the error register while these faults are active. */
static uint32_t register_of(uint32_t faults)
{
    uint32_t bits = faults != 0u ? 0x01u : 0u;
    if ((faults & UINT32_C(0x003F0000)) != 0u) {
        bits |= 0x10u;
    }
    if ((faults & UINT32_C(0x03C0FFFF)) != 0u) {
        bits |= 0x80u;
    }
    return bits;
}

/* If the error register contradicts the faults, the message has another version of this format.
 * Unknown faults set bits of their own. */
static bool is_register_of(uint32_t faults, uint32_t found)
{
    const uint32_t known = faults & FAULTS_KNOWN;
    const uint32_t expected = register_of(known);
    return (known != faults ? (found & expected) : found) == expected;
}

static struct footfall_status status_bits(uint32_t bits)
{
    struct footfall_status status;
    status.state = is_state(bits & 0x07u) ? (enum footfall_state)(bits & 0x07u)
                                           : FOOTFALL_STATE_UNKNOWN;
    status.decision = (enum footfall_decision)(bits >> 3 & 0x01u);
    status.valid = (bits >> 4 & 0x01u) != 0u;
    status.saturated = (bits >> 5 & 0x01u) != 0u;
    status.fault = (bits >> 6 & 0x01u) != 0u;
    status.starting = (bits >> 7 & 0x01u) != 0u;
    return status;
}

static struct footfall_flags flags_bits(uint32_t bits)
{
    struct footfall_flags flags;
    flags.window_not_full = (bits & 0x01u) != 0u;
    flags.attitude_not_initialised = (bits >> 1 & 0x01u) != 0u;
    flags.sample_saturated = (bits >> 2 & 0x01u) != 0u;
    flags.stale = (bits >> 3 & 0x01u) != 0u;
    flags.invalid_sample = (bits >> 4 & 0x01u) != 0u;
    flags.time_gap = (bits >> 5 & 0x01u) != 0u;
    flags.settling = (bits >> 6 & 0x01u) != 0u;
    flags.unproven = (bits >> 7 & 0x01u) != 0u;
    return flags;
}

/* A status that is not valid never reports "stable", whatever its bits: neither as decision nor as a
 * state that implies it. With a fault the state is unknown. */
static struct footfall_status status_of(uint32_t bits)
{
    struct footfall_status status = status_bits(bits);
    if (status.fault || status.saturated || status.starting) {
        status.valid = false;
    }
    if (!status.valid) {
        status.decision = FOOTFALL_DECISION_NOT_STABLE;
        if (status.fault || status.state == FOOTFALL_STATE_STANCE
            || status.state == FOOTFALL_STATE_QUIET_SWING) {
            status.state = FOOTFALL_STATE_UNKNOWN;
        }
    }
    return status;
}

static void read_contact(const uint8_t *data, struct footfall_contact *out)
{
    out->stable_contact_probability = (float)u16_at(data + 0) / 65535.0f;
    out->tangential_probability = (float)data[2] / 255.0f;
    out->vertical_probability = (float)data[3] / 255.0f;
    out->timestamp_us = (uint32_t)u16_at(data + 4) * 10u;
    out->sequence = data[6];
    out->status = status_of(data[7]);
}

static void read_axes(const uint8_t *data, struct footfall_axes *out)
{
    out->probability_ax = (float)data[0] / 255.0f;
    out->probability_ay = (float)data[1] / 255.0f;
    out->probability_az = (float)data[2] / 255.0f;
    out->probability_wx = (float)data[3] / 255.0f;
    out->probability_wy = (float)data[4] / 255.0f;
    out->probability_wz = (float)data[5] / 255.0f;
    out->timestamp_us = (uint32_t)u16_at(data + 6) * 10u;
}

static void read_attitude(const uint8_t *data, struct footfall_attitude *out)
{
    out->quaternion_w = quantity(i16_at(data + 0), 3.051851e-5f);
    out->quaternion_x = quantity(i16_at(data + 2), 3.051851e-5f);
    out->quaternion_y = quantity(i16_at(data + 4), 3.051851e-5f);
    out->quaternion_z = quantity(i16_at(data + 6), 3.051851e-5f);
}

static void read_acceleration(const uint8_t *data, struct footfall_acceleration *out)
{
    out->acceleration_x_m_s2 = quantity(i16_at(data + 0), 0.01f);
    out->acceleration_y_m_s2 = quantity(i16_at(data + 2), 0.01f);
    out->acceleration_z_m_s2 = quantity(i16_at(data + 4), 0.01f);
    out->timestamp_us = (uint32_t)u16_at(data + 6) * 10u;
}

static void read_rate(const uint8_t *data, struct footfall_rate *out)
{
    out->rate_x_rad_s = quantity(i16_at(data + 0), 0.00125f);
    out->rate_y_rad_s = quantity(i16_at(data + 2), 0.00125f);
    out->rate_z_rad_s = quantity(i16_at(data + 4), 0.00125f);
    out->timestamp_us = (uint32_t)u16_at(data + 6) * 10u;
}

static void read_bias(const uint8_t *data, struct footfall_bias *out)
{
    out->bias_x_rad_s = quantity(i16_at(data + 0), 1e-5f);
    out->bias_y_rad_s = quantity(i16_at(data + 2), 1e-5f);
    out->bias_z_rad_s = quantity(i16_at(data + 4), 1e-5f);
    out->temperature_deg_c = quantity(i16_at(data + 6), 0.01f);
}

static void read_health(const uint8_t *data, struct footfall_health *out)
{
    out->flags = flags_bits(data[0]);
    out->error_register = data[1];
    out->dropped = data[2];
    out->sync_counter = data[3];
    out->clock_us = (uint64_t)u32_at(data + 4) * 10u;
}

static bool read_serial_contact(const uint8_t *data, size_t length,
                                struct footfall_serial_contact *out)
{
    if (length != 28u) {
        return false;
    }
    out->timestamp_us = u64_at(data + 0);
    out->stable_contact_probability = (float)u16_at(data + 8) / 65535.0f;
    out->tangential_probability = (float)u16_at(data + 10) / 65535.0f;
    out->vertical_probability = (float)u16_at(data + 12) / 65535.0f;
    out->probability_ax = (float)u16_at(data + 14) / 65535.0f;
    out->probability_ay = (float)u16_at(data + 16) / 65535.0f;
    out->probability_az = (float)u16_at(data + 18) / 65535.0f;
    out->probability_wx = (float)u16_at(data + 20) / 65535.0f;
    out->probability_wy = (float)u16_at(data + 22) / 65535.0f;
    out->probability_wz = (float)u16_at(data + 24) / 65535.0f;
    out->status = status_of(data[26]);
    out->flags = flags_bits(data[27]);
    return true;
}

static bool read_serial_raw(const uint8_t *data, size_t length,
                            struct footfall_serial_raw *out)
{
    if (length != 31u) {
        return false;
    }
    if (!(is_validity(data[8]))) {
        return false;
    }
    out->timestamp_us = u64_at(data + 0);
    out->validity = (enum footfall_validity)data[8];
    out->temperature_deg_c = quantity(i16_at(data + 9), 0.01f);
    out->accelerometer_x_code = i16_at(data + 11);
    out->specific_force_x_m_s2 = (float)i16_at(data + 11) * f32_at(data + 23);
    out->accelerometer_y_code = i16_at(data + 13);
    out->specific_force_y_m_s2 = (float)i16_at(data + 13) * f32_at(data + 23);
    out->accelerometer_z_code = i16_at(data + 15);
    out->specific_force_z_m_s2 = (float)i16_at(data + 15) * f32_at(data + 23);
    out->gyroscope_x_code = i16_at(data + 17);
    out->angular_rate_x_rad_s = (float)i16_at(data + 17) * f32_at(data + 27);
    out->gyroscope_y_code = i16_at(data + 19);
    out->angular_rate_y_rad_s = (float)i16_at(data + 19) * f32_at(data + 27);
    out->gyroscope_z_code = i16_at(data + 21);
    out->angular_rate_z_rad_s = (float)i16_at(data + 21) * f32_at(data + 27);
    out->accelerometer_m_s2_per_code = f32_at(data + 23);
    out->gyroscope_rad_s_per_code = f32_at(data + 27);
    return true;
}

static bool read_serial_health(const uint8_t *data, size_t length,
                               struct footfall_serial_health *out)
{
    if (length != 62u) {
        return false;
    }
    if (!(is_stage(data[8]))) {
        return false;
    }
    if (!(is_node_state((data[9] & 0x7Fu)))) {
        return false;
    }
    if (!(data[10] == 255u || (data[10] >= 1u && data[10] <= 127u))) {
        return false;
    }
    if (!(is_register_of(u32_at(data + 12), data[11]))) {
        return false;
    }
    out->timestamp_us = u64_at(data + 0);
    out->stage = (enum footfall_stage)data[8];
    out->node_state = (enum footfall_node_state)(data[9] & 0x7Fu);
    out->node = (uint8_t)(data[10] == 255u ? 0u : data[10]);
    out->faults = u32_at(data + 12);
    out->temperature_deg_c = quantity(i16_at(data + 16), 0.01f);
    out->ticks = u32_at(data + 18);
    out->valid_samples = u32_at(data + 22);
    out->saturated_samples = u32_at(data + 26);
    out->missed_samples = u32_at(data + 30);
    out->sensor_restarts = u32_at(data + 34);
    out->can_dropped = u32_at(data + 38);
    out->can_bus_off = u32_at(data + 42);
    out->uart_dropped = u32_at(data + 46);
    out->uart_refused = u32_at(data + 50);
    out->uart_overruns = u32_at(data + 54);
    out->late_ticks = u32_at(data + 58);
    return true;
}

static void read_emergency(const uint8_t *data, struct footfall_emergency *out)
{
    out->code = u16_at(data);
    out->error_register = data[2];
    out->fault = is_fault(data[3]) ? (enum footfall_fault)data[3] : FOOTFALL_FAULT_UNKNOWN;
    if (out->code != 0u && out->code != footfall_fault_code(out->fault)) {
        out->fault = FOOTFALL_FAULT_UNKNOWN;
    }
    out->detail = u32_at(data + 4);
}

enum footfall_result footfall_decode(uint32_t cob_id, const uint8_t *data, size_t length,
                                     struct footfall_frame *out)
{
    const uint8_t node = (uint8_t)(cob_id & 0x7Fu);
    if (node == 0u) {
        return FOOTFALL_UNKNOWN_ID;
    }
    out->node = node;
    switch (cob_id - node) {
    case 0x180u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_CONTACT;
        read_contact(data, &out->content.contact);
        return FOOTFALL_OK;
    case 0x280u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_AXES;
        read_axes(data, &out->content.axes);
        return FOOTFALL_OK;
    case 0x380u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_ATTITUDE;
        read_attitude(data, &out->content.attitude);
        return FOOTFALL_OK;
    case 0x480u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_ACCELERATION;
        read_acceleration(data, &out->content.acceleration);
        return FOOTFALL_OK;
    case 0x300u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_RATE;
        read_rate(data, &out->content.rate);
        return FOOTFALL_OK;
    case 0x400u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_BIAS;
        read_bias(data, &out->content.bias);
        return FOOTFALL_OK;
    case 0x500u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_HEALTH;
        read_health(data, &out->content.health);
        return FOOTFALL_OK;
    case 0x080u:
        if (length != 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        out->kind = FOOTFALL_FRAME_KIND_EMERGENCY;
        read_emergency(data, &out->content.emergency);
        return FOOTFALL_OK;
    case 0x700u:
        if (length != 1u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        /* The highest bit belongs to node guarding. */
        if (!is_node_state(data[0] & 0x7Fu)) {
            return FOOTFALL_WRONG_VALUE;
        }
        out->kind = FOOTFALL_FRAME_KIND_HEARTBEAT;
        out->content.heartbeat.state = (enum footfall_node_state)(data[0] & 0x7Fu);
        return FOOTFALL_OK;
    case 0x200u:
        if (length < 4u || length > 8u) {
            return FOOTFALL_WRONG_LENGTH;
        }
        /* Neither infinite nor NaN. */
        if ((u32_at(data) & UINT32_C(0x7F800000)) == UINT32_C(0x7F800000)) {
            return FOOTFALL_WRONG_VALUE;
        }
        out->kind = FOOTFALL_FRAME_KIND_LOAD;
        out->content.load.load = f32_at(data);
        return FOOTFALL_OK;
    default:
        return FOOTFALL_UNKNOWN_ID;
    }
}

/* CRC-32, ISO-HDLC. */
static uint32_t check_of(const uint8_t *data, size_t length)
{
    uint32_t check = UINT32_C(0xFFFFFFFF);
    for (size_t i = 0; i < length; i++) {
        check ^= data[i];
        for (int bit = 0; bit < 8; bit++) {
            check = (check >> 1) ^ ((check & 1u) != 0u ? UINT32_C(0xEDB88320) : 0u);
        }
    }
    return check ^ UINT32_C(0xFFFFFFFF);
}

/* Returns whether the bytes are UTF-8: no overlong character, no surrogate, none above U+10FFFF. */
static bool is_utf8(const uint8_t *text, size_t length)
{
    size_t i = 0;
    while (i < length) {
        const uint8_t first = text[i];
        size_t more = 0;
        /* The range of the second byte excludes these. */
        uint8_t low = 0x80;
        uint8_t high = 0xBF;
        if (first >= 0xC2 && first <= 0xDF) {
            more = 1;
        } else if (first >= 0xE0 && first <= 0xEF) {
            more = 2;
            low = first == 0xE0 ? 0xA0 : low;
            high = first == 0xED ? 0x9F : high;
        } else if (first >= 0xF0 && first <= 0xF4) {
            more = 3;
            low = first == 0xF0 ? 0x90 : low;
            high = first == 0xF4 ? 0x8F : high;
        } else if (first >= 0x80) {
            return false;
        }
        if (more > length - i - 1) {
            return false;
        }
        for (size_t j = 1; j <= more; j++) {
            if (text[i + j] < low || text[i + j] > high) {
                return false;
            }
            low = 0x80;
            high = 0xBF;
        }
        i += more + 1;
    }
    return true;
}

static struct footfall_address address_at(const uint8_t *data)
{
    struct footfall_address address;
    address.index = u16_at(data);
    address.subindex = data[2];
    return address;
}

static bool read_value(const uint8_t *data, size_t length, struct footfall_value *out)
{
    if (length > FOOTFALL_MAX_VALUE) {
        return false;
    }
    memset(out->bytes, 0, sizeof out->bytes);
    memcpy(out->bytes, data, length);
    out->length = (uint8_t)length;
    return true;
}

static bool read_response(const uint8_t *data, size_t length, struct footfall_serial_response *out)
{
    if (length < 4u) {
        return false;
    }
    out->address = address_at(data);
    out->value.length = 0;
    if (data[3] == 1u) {
        out->answer = FOOTFALL_ANSWER_VALUE;
        return read_value(data + 4, length - 4u, &out->value);
    }
    if (data[3] != 0u || length != 8u) {
        return false;
    }
    if (u32_at(data + 4) == 0u) {
        out->answer = FOOTFALL_ANSWER_DONE;
        return true;
    }
    if (!is_abort(u32_at(data + 4))) {
        return false;
    }
    out->answer = FOOTFALL_ANSWER_REFUSED;
    out->reason = (enum footfall_abort)u32_at(data + 4);
    return true;
}

static bool read_log(const uint8_t *data, size_t length, struct footfall_serial_log *out)
{
    if (length < 1u || length - 1u > FOOTFALL_MAX_LOG || !is_utf8(data + 1, length - 1u)) {
        return false;
    }
    out->level = data[0];
    out->length = (uint8_t)(length - 1u);
    memcpy(out->text, data + 1, length - 1u);
    out->text[length - 1u] = '\0';
    return true;
}

static bool read_payload(const uint8_t *data, size_t length, struct footfall_message *out)
{
    switch (out->kind) {
    case FOOTFALL_MESSAGE_KIND_CONTACT:
        return read_serial_contact(data, length, &out->content.contact);
    case FOOTFALL_MESSAGE_KIND_RAW:
        return read_serial_raw(data, length, &out->content.raw);
    case FOOTFALL_MESSAGE_KIND_HEALTH:
        return read_serial_health(data, length, &out->content.health);
    case FOOTFALL_MESSAGE_KIND_CONFIG_GET:
        if (length != 3u) {
            return false;
        }
        out->content.get.address = address_at(data);
        return true;
    case FOOTFALL_MESSAGE_KIND_CONFIG_SET:
        if (length < 3u) {
            return false;
        }
        out->content.set.address = address_at(data);
        return read_value(data + 3, length - 3u, &out->content.set.value);
    case FOOTFALL_MESSAGE_KIND_CONFIG_RESPONSE:
        return read_response(data, length, &out->content.response);
    case FOOTFALL_MESSAGE_KIND_LOG:
        return read_log(data, length, &out->content.log);
    case FOOTFALL_MESSAGE_KIND_NMT:
        if (length != 1u || !is_command(data[0])) {
            return false;
        }
        out->content.nmt.command = (enum footfall_command)data[0];
        return true;
    }
    return false;
}

/* Version, type, sequence of two bytes, payload, CRC of four bytes. */
static enum footfall_result parse(const uint8_t *plain, size_t length, struct footfall_message *out)
{
    if (length < 4u) {
        return FOOTFALL_TOO_SHORT;
    }
    length -= 4u;
    if (check_of(plain, length) != u32_at(plain + length)) {
        return FOOTFALL_WRONG_CHECK;
    }
    if (length < 4u) {
        return FOOTFALL_TOO_SHORT;
    }
    if (plain[0] != 1u) {
        return FOOTFALL_UNKNOWN_VERSION;
    }
    if (!is_message_kind(plain[1])) {
        return FOOTFALL_UNKNOWN_TYPE;
    }
    out->kind = (enum footfall_message_kind)plain[1];
    out->sequence = u16_at(plain + 2);
    return read_payload(plain + 4, length - 4u, out) ? FOOTFALL_OK : FOOTFALL_WRONG_PAYLOAD;
}

void footfall_stream_init(struct footfall_stream *stream)
{
    memset(stream, 0, sizeof *stream);
}

static void push_plain(struct footfall_stream *stream, uint8_t byte)
{
    if (stream->length < FOOTFALL_MAX_DECODED) {
        stream->plain[stream->length] = byte;
        stream->length++;
    } else {
        stream->overflowed = true;
    }
}

/* Consistent Overhead Byte Stuffing: each zero is replaced by the distance to the next, and the
 * first distance goes in front. */
static void push_coded(struct footfall_stream *stream, uint8_t coded)
{
    if (stream->left > 0u) {
        stream->left--;
        push_plain(stream, coded);
        return;
    }
    if (stream->zero_due) {
        push_plain(stream, 0);
    }
    stream->zero_due = coded != 0xFFu;
    stream->left = (uint8_t)(coded - 1u);
}

enum footfall_result footfall_stream_push(struct footfall_stream *stream, uint8_t byte,
                                          struct footfall_message *out)
{
    enum footfall_result result;
    if (byte != 0u) {
        push_coded(stream, byte);
        return FOOTFALL_INCOMPLETE;
    }
    if (stream->overflowed) {
        result = FOOTFALL_TOO_LONG;
    } else if (stream->left > 0u) {
        result = FOOTFALL_WRONG_CODING;
    } else if (stream->length == 0u) {
        /* Zeros between frames are ignored. */
        result = FOOTFALL_INCOMPLETE;
    } else {
        result = parse(stream->plain, stream->length, out);
    }
    stream->length = 0;
    stream->left = 0;
    stream->zero_due = false;
    stream->overflowed = false;
    return result;
}
