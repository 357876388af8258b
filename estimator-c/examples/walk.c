/* Reads the sample rate in Hz, and then one sample per line: µs, m/s² three times, rad/s three times, N, validity. An empty
 * line ends the input. Prints the probability of each sample. With BITS it prints the bits of the whole estimate. */
#include <stdio.h>
#include <string.h>

#include "footfall_estimator.h"

static footfall_memory memory;

#ifdef BITS
static uint32_t bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Little-endian word. */
static unsigned long word(const uint8_t *bytes) {
    return bytes[0] | (unsigned long)bytes[1] << 8 | (unsigned long)bytes[2] << 16 | (unsigned long)bytes[3] << 24;
}

/* Prints the bits of numbers. */
static void print(const float *values, int count) {
    for (int i = 0; i < count; i++) printf(" %08lx", (unsigned long)bits(values[i]));
}
#endif

static int failed(footfall_error error) {
    if (error != FOOTFALL_OK) printf("error: %s\n", footfall_error_text(error));
    return error != FOOTFALL_OK;
}

int main(void) {
    char line[256];
    footfall_params params;
    footfall_estimator *estimator;
    footfall_learnt learnt;
    if (failed(footfall_default_params(&params))) return 1;
    if (fgets(line, sizeof line, stdin) == NULL || sscanf(line, "%f", &params.sample_rate_hz) != 1) return 1;
    if (failed(footfall_estimator_init(&memory, sizeof memory, &params, &estimator))) return 1;
    while (fgets(line, sizeof line, stdin) != NULL && line[0] != '\n') {
        footfall_sample sample;
        footfall_estimate e;
        unsigned long timestamp_us;
        unsigned validity;
        float load, *f = sample.specific_force_m_s2, *w = sample.angular_rate_rad_s;
        if (sscanf(line, "%lu %f %f %f %f %f %f %f %u", &timestamp_us, &f[0], &f[1], &f[2], &w[0], &w[1], &w[2],
                   &load, &validity) != 9)
            return 1;
        sample.timestamp_us = timestamp_us;
        sample.validity = (uint8_t)validity;
        if (failed(footfall_estimator_update(estimator, &sample, &load, &e))) return 1;
#ifdef BITS
        printf("%lu", (unsigned long)e.timestamp_us);
        print(&e.stable, 1);
        print(&e.tangential, 1);
        print(&e.vertical, 1);
        print(e.axes, 6);
        print(e.orientation, 4);
        print(e.linear_acceleration_m_s2, 3);
        print(e.angular_rate_rad_s, 3);
        print(e.gyro_bias_rad_s, 3);
        print(&e.velocity_sigma_m_s, 1);
        printf(" %u %u %u\n", e.decision, e.phase, (unsigned)e.flags);
#else
        printf("%.3f s  P %.3f  %s\n", (double)e.timestamp_us / 1e6, (double)e.stable,
               e.decision == FOOTFALL_STABLE ? "stable" : "");
#endif
    }
    if (failed(footfall_estimator_learnt(estimator, &learnt))) return 1;
#ifdef BITS
    int i;
    printf("learnt");
    for (i = 1; i < 7; i++) printf(" %08lx", word(&learnt.bytes[4 * i]));
    printf("\n");
#endif
    return 0;
}
