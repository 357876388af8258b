/*
 * Prints every member of what footfall.h decodes, for the tests: `print can` reads lines of
 * identifier and data in hexadecimal, `print serial` the bytes of a serial line. Real numbers are
 * printed as their bits.
 */
#include "footfall.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_integer(const char *prefix, const char *name, int64_t value)
{
    printf(" %s%s=%" PRId64, prefix, name, value);
}

static void print_unsigned(const char *prefix, const char *name, uint64_t value)
{
    printf(" %s%s=%" PRIu64, prefix, name, value);
}

static void print_float(const char *prefix, const char *name, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    if (value != value) {
        printf(" %s%s=nan", prefix, name);
    } else {
        printf(" %s%s=%08" PRIx32, prefix, name, bits);
    }
}

static void print_enum(const char *prefix, const char *name, int64_t value, const char *text)
{
    printf(" %s%s=%" PRId64 "(%s)", prefix, name, value, text);
}

static void print_bytes(const char *name, const void *bytes, size_t length)
{
    const unsigned char *byte = (const unsigned char *)bytes;
    printf(" %s=", name);
    for (size_t i = 0; i < length; i++) {
        printf("%02x", (unsigned int)byte[i]);
    }
}

static void print_status(const char *prefix, const struct footfall_status *of)
{
    print_enum(prefix, "state", of->state, footfall_state_name(of->state));
    print_enum(prefix, "decision", of->decision, footfall_decision_name(of->decision));
    print_unsigned(prefix, "valid", of->valid);
    print_unsigned(prefix, "saturated", of->saturated);
    print_unsigned(prefix, "fault", of->fault);
    print_unsigned(prefix, "starting", of->starting);
}

static void print_flags(const char *prefix, const struct footfall_flags *of)
{
    print_unsigned(prefix, "window_not_full", of->window_not_full);
    print_unsigned(prefix, "attitude_not_initialised", of->attitude_not_initialised);
    print_unsigned(prefix, "sample_saturated", of->sample_saturated);
    print_unsigned(prefix, "stale", of->stale);
    print_unsigned(prefix, "invalid_sample", of->invalid_sample);
    print_unsigned(prefix, "time_gap", of->time_gap);
    print_unsigned(prefix, "settling", of->settling);
    print_unsigned(prefix, "unproven", of->unproven);
}

static void print_contact(const char *prefix, const struct footfall_contact *of)
{
    print_float(prefix, "stable_contact_probability", of->stable_contact_probability);
    print_float(prefix, "tangential_probability", of->tangential_probability);
    print_float(prefix, "vertical_probability", of->vertical_probability);
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
    print_unsigned(prefix, "sequence", of->sequence);
    print_status("status.", &of->status);
}

static void print_axes(const char *prefix, const struct footfall_axes *of)
{
    print_float(prefix, "probability_ax", of->probability_ax);
    print_float(prefix, "probability_ay", of->probability_ay);
    print_float(prefix, "probability_az", of->probability_az);
    print_float(prefix, "probability_wx", of->probability_wx);
    print_float(prefix, "probability_wy", of->probability_wy);
    print_float(prefix, "probability_wz", of->probability_wz);
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
}

static void print_attitude(const char *prefix, const struct footfall_attitude *of)
{
    print_float(prefix, "quaternion_w", of->quaternion_w);
    print_float(prefix, "quaternion_x", of->quaternion_x);
    print_float(prefix, "quaternion_y", of->quaternion_y);
    print_float(prefix, "quaternion_z", of->quaternion_z);
}

static void print_acceleration(const char *prefix, const struct footfall_acceleration *of)
{
    print_float(prefix, "acceleration_x_m_s2", of->acceleration_x_m_s2);
    print_float(prefix, "acceleration_y_m_s2", of->acceleration_y_m_s2);
    print_float(prefix, "acceleration_z_m_s2", of->acceleration_z_m_s2);
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
}

static void print_rate(const char *prefix, const struct footfall_rate *of)
{
    print_float(prefix, "rate_x_rad_s", of->rate_x_rad_s);
    print_float(prefix, "rate_y_rad_s", of->rate_y_rad_s);
    print_float(prefix, "rate_z_rad_s", of->rate_z_rad_s);
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
}

static void print_bias(const char *prefix, const struct footfall_bias *of)
{
    print_float(prefix, "bias_x_rad_s", of->bias_x_rad_s);
    print_float(prefix, "bias_y_rad_s", of->bias_y_rad_s);
    print_float(prefix, "bias_z_rad_s", of->bias_z_rad_s);
    print_float(prefix, "temperature_deg_c", of->temperature_deg_c);
}

static void print_health(const char *prefix, const struct footfall_health *of)
{
    print_flags("flags.", &of->flags);
    print_unsigned(prefix, "error_register", of->error_register);
    print_unsigned(prefix, "dropped", of->dropped);
    print_unsigned(prefix, "sync_counter", of->sync_counter);
    print_unsigned(prefix, "clock_us", of->clock_us);
}

static void print_serial_contact(const char *prefix, const struct footfall_serial_contact *of)
{
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
    print_float(prefix, "stable_contact_probability", of->stable_contact_probability);
    print_float(prefix, "tangential_probability", of->tangential_probability);
    print_float(prefix, "vertical_probability", of->vertical_probability);
    print_float(prefix, "probability_ax", of->probability_ax);
    print_float(prefix, "probability_ay", of->probability_ay);
    print_float(prefix, "probability_az", of->probability_az);
    print_float(prefix, "probability_wx", of->probability_wx);
    print_float(prefix, "probability_wy", of->probability_wy);
    print_float(prefix, "probability_wz", of->probability_wz);
    print_status("status.", &of->status);
    print_flags("flags.", &of->flags);
}

static void print_serial_raw(const char *prefix, const struct footfall_serial_raw *of)
{
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
    print_enum(prefix, "validity", of->validity, footfall_validity_name(of->validity));
    print_float(prefix, "temperature_deg_c", of->temperature_deg_c);
    print_integer(prefix, "accelerometer_x_code", of->accelerometer_x_code);
    print_float(prefix, "specific_force_x_m_s2", of->specific_force_x_m_s2);
    print_integer(prefix, "accelerometer_y_code", of->accelerometer_y_code);
    print_float(prefix, "specific_force_y_m_s2", of->specific_force_y_m_s2);
    print_integer(prefix, "accelerometer_z_code", of->accelerometer_z_code);
    print_float(prefix, "specific_force_z_m_s2", of->specific_force_z_m_s2);
    print_integer(prefix, "gyroscope_x_code", of->gyroscope_x_code);
    print_float(prefix, "angular_rate_x_rad_s", of->angular_rate_x_rad_s);
    print_integer(prefix, "gyroscope_y_code", of->gyroscope_y_code);
    print_float(prefix, "angular_rate_y_rad_s", of->angular_rate_y_rad_s);
    print_integer(prefix, "gyroscope_z_code", of->gyroscope_z_code);
    print_float(prefix, "angular_rate_z_rad_s", of->angular_rate_z_rad_s);
    print_float(prefix, "accelerometer_m_s2_per_code", of->accelerometer_m_s2_per_code);
    print_float(prefix, "gyroscope_rad_s_per_code", of->gyroscope_rad_s_per_code);
}

static void print_serial_health(const char *prefix, const struct footfall_serial_health *of)
{
    print_unsigned(prefix, "timestamp_us", of->timestamp_us);
    print_enum(prefix, "stage", of->stage, footfall_stage_name(of->stage));
    print_enum(prefix, "node_state", of->node_state, footfall_node_state_name(of->node_state));
    print_unsigned(prefix, "node", of->node);
    print_unsigned(prefix, "faults", of->faults);
    print_float(prefix, "temperature_deg_c", of->temperature_deg_c);
    print_unsigned(prefix, "ticks", of->ticks);
    print_unsigned(prefix, "valid_samples", of->valid_samples);
    print_unsigned(prefix, "saturated_samples", of->saturated_samples);
    print_unsigned(prefix, "missed_samples", of->missed_samples);
    print_unsigned(prefix, "sensor_restarts", of->sensor_restarts);
    print_unsigned(prefix, "can_dropped", of->can_dropped);
    print_unsigned(prefix, "can_bus_off", of->can_bus_off);
    print_unsigned(prefix, "uart_dropped", of->uart_dropped);
    print_unsigned(prefix, "uart_refused", of->uart_refused);
    print_unsigned(prefix, "uart_overruns", of->uart_overruns);
    print_unsigned(prefix, "late_ticks", of->late_ticks);
}

static void print_frame(const struct footfall_frame *frame)
{
    printf("%s node=%u", footfall_frame_kind_name(frame->kind), (unsigned int)frame->node);
    switch (frame->kind) {
    case FOOTFALL_FRAME_KIND_CONTACT:
        print_contact("", &frame->content.contact);
        break;
    case FOOTFALL_FRAME_KIND_AXES:
        print_axes("", &frame->content.axes);
        break;
    case FOOTFALL_FRAME_KIND_ATTITUDE:
        print_attitude("", &frame->content.attitude);
        break;
    case FOOTFALL_FRAME_KIND_ACCELERATION:
        print_acceleration("", &frame->content.acceleration);
        break;
    case FOOTFALL_FRAME_KIND_RATE:
        print_rate("", &frame->content.rate);
        break;
    case FOOTFALL_FRAME_KIND_BIAS:
        print_bias("", &frame->content.bias);
        break;
    case FOOTFALL_FRAME_KIND_HEALTH:
        print_health("", &frame->content.health);
        break;
    case FOOTFALL_FRAME_KIND_EMERGENCY: {
        const struct footfall_emergency *emergency = &frame->content.emergency;
        print_unsigned("", "code", emergency->code);
        print_unsigned("", "error_register", emergency->error_register);
        print_enum("", "fault", emergency->fault, footfall_fault_name(emergency->fault));
        printf(" of=%u(%s)", (unsigned int)footfall_fault_code(emergency->fault),
               footfall_fault_detail(emergency->fault));
        print_unsigned("", "detail", emergency->detail);
        break;
    }
    case FOOTFALL_FRAME_KIND_HEARTBEAT:
        print_enum("", "state", frame->content.heartbeat.state,
                   footfall_node_state_name(frame->content.heartbeat.state));
        break;
    case FOOTFALL_FRAME_KIND_LOAD:
        print_float("", "load", frame->content.load.load);
        break;
    }
    printf("\n");
}

static void print_address(const struct footfall_address *address)
{
    printf(" object=%04X:%u", (unsigned int)address->index, (unsigned int)address->subindex);
}

static void print_message(const struct footfall_message *message)
{
    printf("%s sequence=%u", footfall_message_kind_name(message->kind),
           (unsigned int)message->sequence);
    switch (message->kind) {
    case FOOTFALL_MESSAGE_KIND_CONTACT:
        print_serial_contact("", &message->content.contact);
        break;
    case FOOTFALL_MESSAGE_KIND_RAW:
        print_serial_raw("", &message->content.raw);
        break;
    case FOOTFALL_MESSAGE_KIND_HEALTH:
        print_serial_health("", &message->content.health);
        break;
    case FOOTFALL_MESSAGE_KIND_CONFIG_GET:
        print_address(&message->content.get.address);
        break;
    case FOOTFALL_MESSAGE_KIND_CONFIG_SET: {
        const struct footfall_serial_set *set = &message->content.set;
        print_address(&set->address);
        print_bytes("value", set->value.bytes, set->value.length);
        break;
    }
    case FOOTFALL_MESSAGE_KIND_CONFIG_RESPONSE: {
        const struct footfall_serial_response *response = &message->content.response;
        print_address(&response->address);
        switch (response->answer) {
        case FOOTFALL_ANSWER_DONE:
            printf(" done");
            break;
        case FOOTFALL_ANSWER_VALUE:
            print_bytes("value", response->value.bytes, response->value.length);
            break;
        case FOOTFALL_ANSWER_REFUSED:
            print_enum("", "refused", response->reason, footfall_abort_name(response->reason));
            break;
        }
        break;
    }
    case FOOTFALL_MESSAGE_KIND_LOG: {
        const struct footfall_serial_log *log = &message->content.log;
        print_unsigned("", "level", log->level);
        print_bytes("text", log->text, log->length);
        print_integer("", "end", log->text[log->length]);
        break;
    }
    case FOOTFALL_MESSAGE_KIND_NMT:
        print_enum("", "command", message->content.nmt.command,
                   footfall_command_name(message->content.nmt.command));
        break;
    }
    printf("\n");
}

static int print_can(void)
{
    char line[256];
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *hex = NULL;
        const uint32_t id = (uint32_t)strtoul(line, &hex, 16);
        unsigned int byte;
        size_t length = 0;
        struct footfall_frame frame;
        enum footfall_result result;
        /* Memory of exactly this length, so that a sanitizer detects a read beyond it. */
        uint8_t *data = (uint8_t *)malloc(64);
        if (data == NULL) {
            return EXIT_FAILURE;
        }
        hex++;
        while (length < 64 && sscanf(hex + 2 * length, "%2x", &byte) == 1) {
            data[length] = (uint8_t)byte;
            length++;
        }
        if (length > 0) {
            uint8_t *exact = (uint8_t *)realloc(data, length);
            data = exact == NULL ? data : exact;
        }
        result = footfall_decode(id, length > 0 ? data : NULL, length, &frame);
        if (result == FOOTFALL_OK) {
            print_frame(&frame);
        } else {
            printf("result %d\n", (int)result);
        }
        free(data);
    }
    return EXIT_SUCCESS;
}

static int print_serial(void)
{
    struct footfall_stream stream;
    struct footfall_message message;
    int byte;
    footfall_stream_init(&stream);
    while ((byte = getchar()) != EOF) {
        const enum footfall_result result = footfall_stream_push(&stream, (uint8_t)byte, &message);
        if (result == FOOTFALL_OK) {
            print_message(&message);
        } else if (result != FOOTFALL_INCOMPLETE) {
            printf("result %d\n", (int)result);
        }
    }
    return EXIT_SUCCESS;
}

int main(int count, char **arguments)
{
    if (count == 2 && strcmp(arguments[1], "can") == 0) {
        return print_can();
    }
    if (count == 2 && strcmp(arguments[1], "serial") == 0) {
        return print_serial();
    }
    fprintf(stderr, "print can|serial\n");
    return EXIT_FAILURE;
}
