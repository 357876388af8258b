/* Runs the estimator over a walk on an Xtensa in QEMU: `qemu-xtensa` gives a program the calls of Linux. Reads the sample rate
 * and then nine words for each sample: µs, force, angular rate, load, validity. Writes the words of each estimate, and at the
 * end the learnt values.
 *
 * The library of the compiler for an LX106 lacks the functions that this chip has in its ROM. They follow below: integers of
 * 64 bits, and floats as IEEE 754 defines them. */
#include <string.h>

#include "footfall_estimator.h"

/* Calls of Linux, by their numbers for an Xtensa. */
enum { READ = 12, WRITE = 13, EXIT = 118 };

static int call(int number, int first, void *second, int third) {
    register int a2 __asm("a2") = number;
    register int a6 __asm("a6") = first;
    register void *a3 __asm("a3") = second;
    register int a4 __asm("a4") = third;
    __asm volatile("syscall" : "+r"(a2) : "r"(a6), "r"(a3), "r"(a4) : "memory");
    return a2;
}

/* Reads as many bytes, and returns whether they were there. */
static int get(void *to, int size) {
    char *at = to;
    while (size > 0) {
        const int count = call(READ, 0, at, size);
        if (count <= 0) return 0;
        at += count;
        size -= count;
    }
    return 1;
}

static void put(void *from, int size) { call(WRITE, 1, from, size); }

static footfall_memory memory;

/* A sample as it is read. */
typedef struct {
    uint32_t timestamp_us;
    float force[3], rate[3], load;
    uint32_t validity;
} Row;

/* An estimate as it is written. */
typedef struct {
    float numbers[23];
    uint32_t decision, phase, flags;
} Answer;

static int run(void) {
    footfall_params params;
    footfall_estimator *estimator;
    footfall_learnt learnt;
    Row row;
    if (footfall_default_params(&params) || !get(&params.sample_rate_hz, sizeof params.sample_rate_hz)) return 1;
    if (footfall_estimator_init(&memory, sizeof memory, &params, &estimator)) return 2;
    while (get(&row, sizeof row)) {
        footfall_sample sample;
        footfall_estimate e;
        Answer answer;
        memset(&sample, 0, sizeof sample);
        sample.timestamp_us = row.timestamp_us;
        memcpy(sample.specific_force_m_s2, row.force, sizeof row.force);
        memcpy(sample.angular_rate_rad_s, row.rate, sizeof row.rate);
        sample.validity = (uint8_t)row.validity;
        if (footfall_estimator_update(estimator, &sample, &row.load, &e)) return 3;
        answer.numbers[0] = e.stable;
        answer.numbers[1] = e.tangential;
        answer.numbers[2] = e.vertical;
        memcpy(answer.numbers + 3, e.axes, sizeof e.axes);
        memcpy(answer.numbers + 9, e.orientation, sizeof e.orientation);
        memcpy(answer.numbers + 13, e.linear_acceleration_m_s2, sizeof e.linear_acceleration_m_s2);
        memcpy(answer.numbers + 16, e.angular_rate_rad_s, sizeof e.angular_rate_rad_s);
        memcpy(answer.numbers + 19, e.gyro_bias_rad_s, sizeof e.gyro_bias_rad_s);
        answer.numbers[22] = e.velocity_sigma_m_s;
        answer.decision = e.decision;
        answer.phase = e.phase;
        answer.flags = e.flags;
        put(&answer, sizeof answer);
    }
    if (footfall_estimator_learnt(estimator, &learnt)) return 4;
    put(learnt.bytes + 4, 24);
    return 0;
}

void start(void);
void start(void) { call(EXIT, run(), NULL, 0); }
__asm(".text\n.global _start\n_start: call0 start\n");

/* Products of integers, from those of 16 bits. */
uint64_t __umulsidi3(uint32_t, uint32_t);
uint64_t __umulsidi3(uint32_t a, uint32_t b) {
    const uint32_t low = (a & 0xFFFF) * (b & 0xFFFF);
    const uint32_t left = (a >> 16) * (b & 0xFFFF) + (low >> 16);
    const uint32_t right = (a & 0xFFFF) * (b >> 16) + (left & 0xFFFF);
    const uint32_t high = (a >> 16) * (b >> 16) + (left >> 16) + (right >> 16);
    return (uint64_t)high << 32 | (right << 16 | (low & 0xFFFF));
}

uint64_t __muldi3(uint64_t, uint64_t);
uint64_t __muldi3(uint64_t a, uint64_t b) {
    const uint32_t crossed = (uint32_t)(a >> 32) * (uint32_t)b + (uint32_t)a * (uint32_t)(b >> 32);
    return __umulsidi3((uint32_t)a, (uint32_t)b) + ((uint64_t)crossed << 32);
}

/* Quotients and rests of integers, a bit at a time. */
static uint64_t divided(uint64_t dividend, uint64_t divisor, uint64_t *rest) {
    uint64_t quotient = 0, left = 0;
    int bit;
    for (bit = 63; bit >= 0; bit--) {
        left = left << 1 | (dividend >> bit & 1);
        if (left >= divisor) {
            left -= divisor;
            quotient |= (uint64_t)1 << bit;
        }
    }
    *rest = left;
    return quotient;
}

uint64_t __udivdi3(uint64_t, uint64_t);
uint64_t __udivdi3(uint64_t a, uint64_t b) { return divided(a, b, &a); }
uint64_t __umoddi3(uint64_t, uint64_t);
uint64_t __umoddi3(uint64_t a, uint64_t b) { return divided(a, b, &b), b; }
uint32_t __udivsi3(uint32_t, uint32_t);
uint32_t __udivsi3(uint32_t a, uint32_t b) { return (uint32_t)__udivdi3(a, b); }
uint32_t __umodsi3(uint32_t, uint32_t);
uint32_t __umodsi3(uint32_t a, uint32_t b) { return (uint32_t)__umoddi3(a, b); }

/* Bits of a float: ±, eight of its exponent, 23 below the point. */
enum { SIGN_AT = 31, POINT = 23 };
static const uint32_t SIGN = 0x80000000U, INFINITE = 0x7F800000U, NOT_A_NUMBER = 0x7FC00000U;

static int is_finite(uint32_t a) { return (a & INFINITE) != INFINITE; }
static int is_nan(uint32_t a) { return (a & ~SIGN) > INFINITE; }

/* A finite float is ± mantissa * 2^exponent. */
static uint32_t mantissa_of(uint32_t a) {
    const uint32_t fraction = a & 0x7FFFFF;
    return (a & INFINITE) == 0 ? fraction : fraction | 0x800000;
}
static int exponent_of(uint32_t a) {
    const int field = (int)(a >> POINT & 0xFF);
    return (field == 0 ? 1 : field) - 150;
}

/* The float nearest to mantissa * 2^exponent, the even one of two. */
static uint32_t nearest(uint32_t sign, int exponent, uint64_t mantissa) {
    int shift = -POINT;
    uint64_t bits;
    if (mantissa == 0) return sign;
    for (bits = mantissa; bits > 1; bits >>= 1) shift++;
    if (shift + exponent < -149) shift = -149 - exponent;
    if (shift > 63) return sign;
    if (shift > 0) {
        const uint64_t half = (uint64_t)1 << (shift - 1), rest = mantissa & (2 * half - 1);
        mantissa >>= shift;
        if (rest > half || (rest == half && (mantissa & 1) != 0)) mantissa++;
    } else {
        mantissa <<= -shift;
    }
    bits = mantissa;
    /* The highest bit of the mantissa adds 1 to the exponent's field. */
    if (mantissa >= 0x800000) bits += (uint64_t)(uint32_t)(shift + exponent + 149) << POINT;
    return sign | (bits < INFINITE ? (uint32_t)bits : INFINITE);
}

uint32_t __addsf3(uint32_t, uint32_t);
uint32_t __addsf3(uint32_t a, uint32_t b) {
    uint64_t left, right;
    uint32_t sign;
    int exponent, distance;
    if (is_nan(a) || is_nan(b)) return NOT_A_NUMBER;
    if (!is_finite(a)) return is_finite(b) || a == b ? a : NOT_A_NUMBER;
    if (!is_finite(b)) return b;
    if ((a & ~SIGN) < (b & ~SIGN)) {
        const uint32_t other = a;
        a = b;
        b = other;
    }
    sign = a & SIGN;
    exponent = exponent_of(b);
    distance = exponent_of(a) - exponent;
    left = mantissa_of(a);
    right = mantissa_of(b);
    if (distance > 35) {
        /* Only that it is not zero counts. */
        exponent += distance - 35;
        right = right != 0;
        distance = 35;
    }
    left <<= distance;
    if (sign == (b & SIGN)) return nearest(sign, exponent, left + right);
    return left == right ? 0 : nearest(sign, exponent, left - right);
}

uint32_t __subsf3(uint32_t, uint32_t);
uint32_t __subsf3(uint32_t a, uint32_t b) { return __addsf3(a, b ^ SIGN); }

uint32_t __mulsf3(uint32_t, uint32_t);
uint32_t __mulsf3(uint32_t a, uint32_t b) {
    const uint32_t sign = (a ^ b) & SIGN;
    if (is_nan(a) || is_nan(b)) return NOT_A_NUMBER;
    if (!is_finite(a) || !is_finite(b)) {
        return ((a & ~SIGN) != 0 && (b & ~SIGN) != 0) ? sign | INFINITE : NOT_A_NUMBER;
    }
    return nearest(sign, exponent_of(a) + exponent_of(b), __umulsidi3(mantissa_of(a), mantissa_of(b)));
}

uint32_t __floatunsisf(uint32_t);
uint32_t __floatunsisf(uint32_t value) { return nearest(0, 0, value); }
uint32_t __floatsisf(int32_t);
uint32_t __floatsisf(int32_t value) {
    return value < 0 ? nearest(SIGN, 0, 0U - (uint32_t)value) : nearest(0, 0, (uint32_t)value);
}

uint32_t __fixunssfsi(uint32_t);
uint32_t __fixunssfsi(uint32_t a) {
    const int exponent = exponent_of(a);
    if ((a & SIGN) != 0 || exponent < -POINT) return 0;
    if (exponent > 8) return UINT32_MAX;
    return exponent < 0 ? mantissa_of(a) >> -exponent : mantissa_of(a) << exponent;
}
