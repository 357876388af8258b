/* Counts the instructions of each update under QEMU's -icount shift=0. Prints the mean and the largest count, and then the
 * learnt values. Link with -Wl,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt. */
#include <stdio.h>

#include "wrapped.h"

#ifdef __riscv
static uint32_t ticks(void) {
    register uint32_t count __asm("a0");
    __asm volatile(".word 0xC0202573" : "=r"(count)); /* csrr a0, instret, which needs no extension here */
    return count;
}
#else
/* SysTick, which counts down from 2^24 - 1. */
static volatile uint32_t *const systick = (volatile uint32_t *)0xE000E010;
static uint32_t ticks(void) {
    if ((systick[0] & 1) == 0) {
        systick[1] = 0xFFFFFF;
        systick[2] = 0;
        systick[0] = 5;
    }
    return 0xFFFFFF - systick[2];
}
#endif

static uint32_t since(uint32_t start) { return (ticks() - start) & 0xFFFFFF; }

static uint64_t sum;
static uint32_t count, largest;

footfall_error __wrap_footfall_estimator_update(footfall_estimator *estimator, const footfall_sample *sample,
                                                const float *load, footfall_estimate *estimate) {
    const uint32_t start = ticks();
    const footfall_error error = __real_footfall_estimator_update(estimator, sample, load, estimate);
    const uint32_t taken = since(start);
    sum += taken;
    count++;
    if (taken > largest) largest = taken;
    return error;
}

footfall_error __wrap_footfall_estimator_learnt(const footfall_estimator *estimator, footfall_learnt *learnt) {
    /* A million instructions, for the length of a tick. */
    uint32_t start, million, loops = 100000;
    start = ticks();
#ifdef __riscv
    __asm volatile("1: nop; nop; nop; nop; nop; nop; nop; nop; addi %0, %0, -1; bnez %0, 1b" : "+r"(loops));
#else
    __asm volatile(".syntax unified\n1: nop; nop; nop; nop; nop; nop; nop; nop; subs %0, #1; bne 1b" : "+l"(loops) : : "cc");
#endif
    million = since(start);
    printf("instructions %lu %lu\n", (unsigned long)(sum * 1000000 / million / count),
           (unsigned long)((uint64_t)largest * 1000000 / million));
    return __real_footfall_estimator_learnt(estimator, learnt);
}
