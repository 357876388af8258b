
/* Functions of the header. Each copies the objects behind its pointers into the machine's memory, and back. */

/* Addresses behind the stack and the estimator. The objects of a call share the last ones. */
enum {
    PARAMS = ESTIMATOR + ESTIMATOR_SIZE,
    CREATED = PARAMS + 72,
    SAMPLE = PARAMS,
    ESTIMATE = SAMPLE + 40,
    LOAD_ON_FOOT = ESTIMATE + 112,
    LEARNT = PARAMS,
    FORCE = PARAMS
};

/* Fails to compile where an object has another layout than in the machine's memory. */
#define SAME_LAYOUT(type, size, last, offset) \
    typedef char type##_has_its_layout[sizeof(type) == (size) && offsetof(type, last) == (offset) ? 1 : -1]
SAME_LAYOUT(footfall_params, 68, learning, 66);
SAME_LAYOUT(footfall_sample, 40, validity, 32);
SAME_LAYOUT(footfall_estimate, 112, reserved, 106);
SAME_LAYOUT(footfall_learnt, 28, bytes, 0);

#define ALIGNMENT_OF(name, type)  \
    struct before_##name {         \
        char before;               \
        type object;               \
    };                             \
    enum { ALIGNMENT_##name = offsetof(struct before_##name, object) }
ALIGNMENT_OF(ESTIMATOR, u64);
ALIGNMENT_OF(PARAMS, footfall_params);
ALIGNMENT_OF(POINTER, footfall_estimator *);
ALIGNMENT_OF(SAMPLE, footfall_sample);
ALIGNMENT_OF(ESTIMATE, footfall_estimate);
ALIGNMENT_OF(FLOAT, float);

static void start(Machine *machine) { machine->w2c_g0 = STACK_SIZE; }

/* Address of an object: 0 for NULL, and misaligned as the pointer is. */
static u32 address_of(u32 address, const void *pointer, size_t alignment) {
    return pointer == NULL ? 0 : address + (u32)((uintptr_t)pointer % alignment);
}

/* Copies an object into the machine, unless the pointer cannot be used. Returns its address. */
static u32 give(Machine *machine, u32 address, const void *pointer, size_t alignment, size_t size) {
    const u32 given = address_of(address, pointer, alignment);
    if (given == address) memcpy(machine->memory.bytes + address, pointer, size);
    return given;
}

/* Copies an object out of the machine, unless the pointer cannot be used. */
static void take(const Machine *machine, u32 address, void *pointer, size_t alignment, size_t size) {
    if (address_of(address, pointer, alignment) == address) memcpy(pointer, machine->memory.bytes + address, size);
}

static u32 give_estimator(Machine *machine, const footfall_estimator *estimator) {
    start(machine);
    return give(machine, ESTIMATOR, estimator, ALIGNMENT_ESTIMATOR, ESTIMATOR_SIZE);
}

static void take_estimator(const Machine *machine, void *estimator) {
    take(machine, ESTIMATOR, estimator, ALIGNMENT_ESTIMATOR, ESTIMATOR_SIZE);
}

const char *footfall_version(void) { return FOOTFALL_VERSION; }

const char *footfall_error_text(footfall_error error) {
    Machine machine;
    start(&machine);
    return (const char *)constants + (w2c_footfall_error_text(&machine, (u32)error) - CONSTANTS);
}

size_t footfall_estimator_size(void) { return ESTIMATOR_SIZE; }

size_t footfall_estimator_align(void) { return ALIGNMENT_ESTIMATOR; }

footfall_error footfall_default_params(footfall_params *params) {
    Machine machine;
    footfall_error error;
    start(&machine);
    error = (footfall_error)w2c_footfall_default_params(
        &machine, address_of(PARAMS, params, ALIGNMENT_PARAMS));
    if (error == FOOTFALL_OK) take(&machine, PARAMS, params, ALIGNMENT_PARAMS, sizeof *params);
    return error;
}

footfall_error footfall_estimator_init(void *memory, size_t size, const footfall_params *params,
                                       footfall_estimator **estimator) {
    Machine machine;
    footfall_error error;
    const u32 created = address_of(CREATED, estimator, ALIGNMENT_POINTER);
    start(&machine);
    error = (footfall_error)w2c_footfall_estimator_init(
        &machine, address_of(ESTIMATOR, memory, ALIGNMENT_ESTIMATOR), size > UINT32_MAX ? UINT32_MAX : (u32)size,
        give(&machine, PARAMS, params, ALIGNMENT_PARAMS, sizeof *params), created);
    if (created != CREATED) return error;
    *estimator = error == FOOTFALL_OK ? (footfall_estimator *)memory : NULL;
    if (error == FOOTFALL_OK) {
        take_estimator(&machine, memory);
    } else if (size >= ESTIMATOR_SIZE && address_of(ESTIMATOR, memory, ALIGNMENT_ESTIMATOR) == ESTIMATOR) {
        memset(memory, 0, 4); /* the mark of an estimator */
    }
    return error;
}

footfall_error footfall_estimator_update(footfall_estimator *estimator, const footfall_sample *sample,
                                         const float *load, footfall_estimate *estimate) {
    Machine machine;
    footfall_error error;
    const u32 at = give_estimator(&machine, estimator);
    error = (footfall_error)w2c_footfall_estimator_update(
        &machine, at, give(&machine, SAMPLE, sample, ALIGNMENT_SAMPLE, sizeof *sample),
        give(&machine, LOAD_ON_FOOT, load, ALIGNMENT_FLOAT, sizeof *load),
        address_of(ESTIMATE, estimate, ALIGNMENT_ESTIMATE));
    if (error == FOOTFALL_OK) take_estimator(&machine, estimator);
    take(&machine, ESTIMATE, estimate, ALIGNMENT_ESTIMATE, sizeof *estimate);
    return error;
}

footfall_error footfall_estimator_spread_timestamps(footfall_estimator *estimator, footfall_sample *samples,
                                                    size_t count) {
    Machine machine;
    footfall_error error;
    u64 newest_us;
    u32 i;
    const u32 at = give_estimator(&machine, estimator);
    /* Checks all but the samples, for which there is no room. */
    error = (footfall_error)w2c_footfall_estimator_spread_timestamps(
        &machine, at, address_of(SAMPLE, samples, ALIGNMENT_SAMPLE),
        count > FOOTFALL_MOST_SAMPLES ? FOOTFALL_MOST_SAMPLES + 1 : 0);
    if (error != FOOTFALL_OK || count == 0) return error;
    newest_us = samples[count - 1].timestamp_us;
    w2c_footfall_begin_read(&machine, at, (u32)count);
    for (i = 0; i < count; i++) {
        samples[i].timestamp_us = w2c_footfall_time_in_read(&machine, at, newest_us, (u32)count, i);
    }
    take_estimator(&machine, estimator);
    return error;
}

footfall_error footfall_estimator_check_unit(const footfall_estimator *estimator) {
    Machine machine;
    const u32 at = give_estimator(&machine, estimator);
    return (footfall_error)w2c_footfall_estimator_check_unit(&machine, at);
}

footfall_error footfall_estimator_force_at_rest(const footfall_estimator *estimator, float *force_m_s2) {
    Machine machine;
    const u32 at = give_estimator(&machine, estimator);
    const footfall_error error = (footfall_error)w2c_footfall_estimator_force_at_rest(
        &machine, at, address_of(FORCE, force_m_s2, ALIGNMENT_FLOAT));
    take(&machine, FORCE, force_m_s2, ALIGNMENT_FLOAT, sizeof *force_m_s2);
    return error;
}

footfall_error footfall_estimator_learnt(const footfall_estimator *estimator, footfall_learnt *learnt) {
    Machine machine;
    const u32 at = give_estimator(&machine, estimator);
    const footfall_error error = (footfall_error)w2c_footfall_estimator_learnt(
        &machine, at, address_of(LEARNT, learnt, 1));
    take(&machine, LEARNT, learnt, 1, sizeof *learnt);
    return error;
}

#else
/* A translation unit is not empty. */
typedef int footfall_generic_is_not_used;
#endif
