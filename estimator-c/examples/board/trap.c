/* Traps unaligned access within the library, as a program may do in all of its code: CCR.UNALIGN_TRP. Link with
 * -Wl,--wrap=footfall_estimator_init,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt, and with
 * -Wl,--wrap=memcpy, because newlib's accesses words at any address. */
#include "wrapped.h"

void *__wrap_memcpy(void *, const void *, size_t);

void *__wrap_memcpy(void *to, const void *from, size_t count) {
    volatile unsigned char *byte = to;
    const unsigned char *source = from;
    while (count-- > 0) *byte++ = *source++;
    return to;
}

static volatile uint32_t *const ccr = (volatile uint32_t *)0xE000ED14;

static void set_trap(uint32_t on) {
    *ccr = (*ccr & ~(UINT32_C(1) << 3)) | on << 3;
    __asm volatile("dsb\n\tisb");
}

#ifdef UNALIGNED
/* An access that the trap must find. */
static void read_unaligned(void) {
    static const uint32_t words[2] = {1, 2};
    uint32_t word;
    __asm volatile("ldr %0, [%1]" : "=r"(word) : "r"((const char *)words + 1));
}
#else
static void read_unaligned(void) {}
#endif

footfall_error __wrap_footfall_estimator_init(void *memory, size_t size, const footfall_params *params,
                                              footfall_estimator **estimator) {
    footfall_error error;
    set_trap(1);
    read_unaligned();
    error = __real_footfall_estimator_init(memory, size, params, estimator);
    set_trap(0);
    return error;
}

footfall_error __wrap_footfall_estimator_update(footfall_estimator *estimator, const footfall_sample *sample,
                                                const float *load, footfall_estimate *estimate) {
    footfall_error error;
    set_trap(1);
    error = __real_footfall_estimator_update(estimator, sample, load, estimate);
    set_trap(0);
    return error;
}

footfall_error __wrap_footfall_estimator_learnt(const footfall_estimator *estimator, footfall_learnt *learnt) {
    footfall_error error;
    set_trap(1);
    error = __real_footfall_estimator_learnt(estimator, learnt);
    set_trap(0);
    return error;
}
