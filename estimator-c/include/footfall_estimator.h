/* Stable-contact probability of a robot's foot, from the IMU on it. C99 and C++.
 *
 * The method is self-calibrating: it learns its limits while the foot walks. It has no window, so an estimator takes little
 * more than 1 KiB. The paper's method with configured half-widths is only in the Rust library.
 *
 * The library has no allocation, no global state, no locks, no input or output. Use an estimator in one thread or
 * interrupt at a time; several estimators are independent. The computation is additions, multiplications, divisions and
 * square roots in binary32, with the same bits on every machine whose FPU or soft-float library follows IEEE 754 without
 * flush-to-zero.
 *
 * NULL and misaligned pointers, too little memory and numbers out of range are errors. Other pointers must point to an
 * object of their type, and objects of one call must not overlap. */
#ifndef FOOTFALL_ESTIMATOR_H
#define FOOTFALL_ESTIMATOR_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header. Before 1.0 an incompatible change raises the minor version. */
#define FOOTFALL_VERSION_MAJOR 0
#define FOOTFALL_VERSION_MINOR 1
#define FOOTFALL_VERSION_PATCH 0
#define FOOTFALL_VERSION "0.1.0"

/* Results of the functions, of type footfall_error. */
enum {
    FOOTFALL_OK = 0,
    FOOTFALL_ERROR_NULL = 1,            /* a required pointer is NULL */
    FOOTFALL_ERROR_MISALIGNED = 2,      /* a pointer is not aligned to its type */
    FOOTFALL_ERROR_TOO_SMALL = 3,       /* less memory than footfall_estimator_size() */
    FOOTFALL_ERROR_NOT_INITIALISED = 4, /* memory without an estimator */
    FOOTFALL_ERROR_CHOICE = 5,          /* a field has a value other than its constants */
    FOOTFALL_ERROR_SAMPLE_RATE = 6,     /* out of range, or NaN; the same below */
    FOOTFALL_ERROR_DECISION = 7,
    FOOTFALL_ERROR_LOAD = 8,
    FOOTFALL_ERROR_VELOCITY = 9,
    FOOTFALL_ERROR_LEARNT = 10, /* damaged, of another version, or out of range: start without it */
    FOOTFALL_ERROR_COUNT = 11,  /* more than FOOTFALL_MOST_SAMPLES samples */
    FOOTFALL_ERROR_UNIT = 12    /* readings in g or mg, another full scale, or a wrong scale */
};
typedef int32_t footfall_error;

/* Memory of one estimator. Other memory needs footfall_estimator_size() bytes, aligned to footfall_estimator_align(). The
 * difference of a third is room for later versions.
 *
 * You may move an estimator: it holds no pointer, so copy its bytes to other memory of this size and alignment, and use them
 * there. If you use both copies, each goes on from the state at the time of the copy. */
#define FOOTFALL_ESTIMATOR_SIZE 1536
typedef union {
    uint64_t align;
    unsigned char bytes[FOOTFALL_ESTIMATOR_SIZE];
} footfall_memory;

/* An estimator in the caller's memory. */
typedef struct footfall_estimator footfall_estimator;

/* State learnt from a foot. Store its 28 bytes unchanged. They are the same on every machine: seven little-endian words, a
 * version, five numbers in binary32, and the CRC-32 (ISO-HDLC) of the bytes before. footfall_estimator_init() returns an
 * error for a state with a flipped bit, of another version, or of zeros. Without a state the foot learns again. */
typedef struct {
    uint8_t bytes[28];
} footfall_learnt;

enum { FOOTFALL_GRAVITY_INCLUDED = 0, FOOTFALL_GRAVITY_REMOVED = 1 };
enum { FOOTFALL_LEARNING_ON = 0, FOOTFALL_LEARNING_FROZEN = 1 };

/* Parameters; footfall_default_params() fills in values for any robot and a sample rate of 1 kHz. */
typedef struct {
    float sample_rate_hz;       /* 20 to 10000 */
    float decision_threshold;   /* probability above which contact is stable, 0.01 to 0.99 */
    float decision_on_delay_s;  /* time above it until the decision is "stable", at most 10 */
    float decision_off_delay_s; /* time below it until the decision is "not stable", at most 0.2 */
    float load_on;              /* loaded from this load on, N or any unit */
    float load_off;             /* unloaded below this load, at most load_on */
    float velocity_speed_m_s;   /* standard deviation of the velocity at a probability of 0.5; 0.001 to 10 */
    float velocity_lever_m;     /* from the IMU to the point about which a standing foot turns; 0 to 10 */
    float velocity_floor_m_s;   /* least standard deviation; 0.0001 to 1 */
    footfall_learnt learnt;     /* of footfall_estimator_learnt(), for a warm start */
    uint8_t has_learnt;         /* 1: `learnt` is used, 0: it is ignored */
    uint8_t gravity;            /* FOOTFALL_GRAVITY_... : included, as measured by an accelerometer, or removed */
    uint8_t learning;           /* FOOTFALL_LEARNING_... */
} footfall_params;

/* Quality of a sample, as reported by its source. */
enum {
    FOOTFALL_SAMPLE_VALID = 0,
    FOOTFALL_SAMPLE_ACCELEROMETER_SATURATED = 1,
    FOOTFALL_SAMPLE_GYROSCOPE_SATURATED = 2,
    FOOTFALL_SAMPLE_SATURATED = 3,
    FOOTFALL_SAMPLE_STALE = 4,  /* no new reading: the values repeat an earlier one */
    FOOTFALL_SAMPLE_INVALID = 5 /* the reading failed */
};

/* Reading of an IMU: right-handed axes, the same for both sensors. */
typedef struct {
    uint64_t timestamp_us;        /* time of acquisition, microseconds from any start, increasing; see _update() for jumps */
    float specific_force_m_s2[3]; /* x, y, z; at rest 9.81 upwards */
    float angular_rate_rad_s[3];
    uint8_t validity; /* FOOTFALL_SAMPLE_... */
} footfall_sample;

/* Bits of footfall_estimate.flags: reasons to doubt. All but TIME_GAP, SETTLING, UNIT and GRAVITY end the decision
 * "stable". Later versions may set more bits. */
enum {
    FOOTFALL_FLAG_WINDOW_NOT_FULL = 1, /* the first samples for which up is known */
    FOOTFALL_FLAG_ATTITUDE_NOT_INITIALISED = 2,
    FOOTFALL_FLAG_SATURATED = 4,
    FOOTFALL_FLAG_STALE = 8,
    FOOTFALL_FLAG_INVALID_SAMPLE = 16, /* not finite, beyond any sensor, not later than the one before, or after a jump */
    FOOTFALL_FLAG_TIME_GAP = 32,
    FOOTFALL_FLAG_SETTLING = 64, /* few steps so far: the limits are those for any foot; permanent if the unit is wrong */
    FOOTFALL_FLAG_UNPROVEN = 128, /* neither rested nor landed for longer than a stride: the probability is at most 0.5 */
    FOOTFALL_FLAG_UNIT = 256,     /* footfall_estimator_check_unit() returns an error, and another flag is set */
    FOOTFALL_FLAG_GRAVITY = 512   /* gravity is "removed" by the parameters, but not from the samples: never stable */
};

enum { FOOTFALL_NOT_STABLE = 0, FOOTFALL_STABLE = 1 };
enum {
    FOOTFALL_PHASE_UNKNOWN = 0, /* no load passed, or doubt */
    FOOTFALL_PHASE_STANCE = 1,
    FOOTFALL_PHASE_SLIP = 2,
    FOOTFALL_PHASE_SWING = 3,
    FOOTFALL_PHASE_QUIET_SWING = 4,
    FOOTFALL_PHASE_LANDING = 5 /* from touch-down until stable, at most 150 ms */
};

/* Estimate after a sample, in the axes of the sample. */
typedef struct {
    uint64_t timestamp_us;
    float stable;         /* probability of stable contact, 0 to 1 */
    float tangential;     /* of no motion along the ground */
    float vertical;       /* of no lifting */
    float axes[6];        /* of no motion along and about each axis: ax, ay, az, wx, wy, wz */
    float orientation[4]; /* Hamilton quaternion w, x, y, z, foot to world, z up, any heading */
    float linear_acceleration_m_s2[3]; /* without gravity; 0 if unknown */
    float angular_rate_rad_s[3];       /* without bias; 0 if unknown */
    float gyro_bias_rad_s[3];
    float velocity_sigma_m_s; /* standard deviation of "the foot's velocity is 0" */
    uint32_t flags;           /* FOOTFALL_FLAG_... */
    uint8_t decision;         /* FOOTFALL_STABLE or FOOTFALL_NOT_STABLE, debounced */
    uint8_t phase;            /* FOOTFALL_PHASE_... */
    uint8_t reserved[6];      /* 0 */
} footfall_estimate;

/* Version of the library; equal to FOOTFALL_VERSION if header and library come from the same archive. */
const char *footfall_version(void);

/* English text of an error; never NULL. */
const char *footfall_error_text(footfall_error error);

/* Bytes and alignment of an estimator's memory. */
size_t footfall_estimator_size(void);
size_t footfall_estimator_align(void);

/* Writes the default parameters. */
footfall_error footfall_default_params(footfall_params *params);

/* Creates an estimator without samples in `memory`, which must outlive it. Nothing needs to be freed. An error sets
 * `*estimator` to NULL. */
footfall_error footfall_estimator_init(void *memory, size_t size, const footfall_params *params,
                                       footfall_estimator **estimator);

/* Processes the next sample. `load` is the load on the foot, or NULL if it is unknown; an infinite or NaN load counts as
 * unknown. An infinite or NaN sample is not an error: it lowers the probability and sets FOOTFALL_FLAG_INVALID_SAMPLE.
 * An error leaves the estimator unchanged and writes the doubtful estimate to `*estimate`: not stable, probability 0,
 * sigma 100 m/s, no turn, FOOTFALL_FLAG_INVALID_SAMPLE.
 *
 * A timestamp that jumps backwards, or forwards by more than 13 ms and a missing sample, makes this one sample invalid, and
 * the estimator does without it. If the next timestamp comes back, one sample is missing, which ends no stance. If it
 * does not, the jump was real: a gap has TIME_GAP at the next sample, and after a clock was set back the estimator goes on. */
footfall_error footfall_estimator_update(footfall_estimator *estimator, const footfall_sample *sample,
                                         const float *load, footfall_estimate *estimate);

/* Spreads the timestamps of samples that were read at once, such as from a sensor's FIFO. The oldest sample comes first.
 * Set the timestamp of the last one; the function writes the others. Then update with each. Of samples with the
 * same timestamp all but one are invalid. The timestamps are evenly spaced between the previous newest sample and this
 * one, or one period apart in the first read and after a gap. If the time of a read jumps, all of its samples are
 * invalid. `count` is 0 to FOOTFALL_MOST_SAMPLES. */
#define FOOTFALL_MOST_SAMPLES 4096
footfall_error footfall_estimator_spread_timestamps(footfall_estimator *estimator, footfall_sample *samples,
                                                    size_t count);

/* Returns FOOTFALL_ERROR_UNIT if no foot can have the forces of the last half second, because they are in g or mg, or of
 * another full scale, or because the scale is wrong by more than 12 %. Call it if the flags do not clear. Returns
 * FOOTFALL_OK if the force is plausible, or not known yet. */
footfall_error footfall_estimator_check_unit(const footfall_estimator *estimator);

/* Writes the length of the mean specific force of a foot that rests, m/s^2, to `*force_m_s2`; NaN while it does not rest, and
 * if gravity was removed. Divide 9.80665 by it for the factor of a wrong scale. */
footfall_error footfall_estimator_force_at_rest(const footfall_estimator *estimator, float *force_m_s2);

/* Writes the state learnt so far, for `learnt` of the parameters at the next start. An error writes zeros. */
footfall_error footfall_estimator_learnt(const footfall_estimator *estimator, footfall_learnt *learnt);

#ifdef __cplusplus
}
#endif

#endif
