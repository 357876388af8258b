/* Measures the stack of init, update and learnt: paints the memory below the stack pointer before each call, and looks
 * afterwards for the lowest word that has changed. Prints the largest of each, and then the learnt values. Link with
 * -Wl,--wrap=footfall_estimator_init,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt. */
#include <stdio.h>

#include "wrapped.h"

enum { WORDS = 1536, PAINT = 0x5AFE57AC };

#ifdef __riscv
#define STACK_POINTER "mv %0, sp"
#else
#define STACK_POINTER "mov %0, sp"
#endif

/* Paints, calls, and keeps the largest depth in bytes. It is a macro, because a function would use the painted
 * memory. */
#define MEASURED(largest, call)                                                            \
    do {                                                                                   \
        volatile uint32_t *top;                                                            \
        uint32_t word;                                                                     \
        __asm volatile(STACK_POINTER : "=r"(top));                                         \
        for (word = 1; word <= WORDS; word++) top[-(int32_t)word] = PAINT;                 \
        error = (call);                                                                    \
        for (word = WORDS; word > 0 && top[-(int32_t)word] == PAINT; word--) continue;     \
        if (4 * word > (largest)) (largest) = 4 * word;                                    \
    } while (0)

static uint32_t of_init, of_update, of_learnt;

footfall_error __wrap_footfall_estimator_init(void *memory, size_t size, const footfall_params *params,
                                              footfall_estimator **estimator) {
    footfall_error error;
    MEASURED(of_init, __real_footfall_estimator_init(memory, size, params, estimator));
    return error;
}

footfall_error __wrap_footfall_estimator_update(footfall_estimator *estimator, const footfall_sample *sample,
                                                const float *load, footfall_estimate *estimate) {
    footfall_error error;
    MEASURED(of_update, __real_footfall_estimator_update(estimator, sample, load, estimate));
    return error;
}

footfall_error __wrap_footfall_estimator_learnt(const footfall_estimator *estimator, footfall_learnt *learnt) {
    footfall_error error;
    MEASURED(of_learnt, __real_footfall_estimator_learnt(estimator, learnt));
    printf("stack %lu %lu %lu\n", (unsigned long)of_init, (unsigned long)of_update, (unsigned long)of_learnt);
    return error;
}
