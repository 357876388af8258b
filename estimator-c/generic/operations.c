/* The estimator in C99, for processors and compilers without a library in this archive, such as Xtensa, IAR and Keil.
 *
 * Made by `cargo xtask library` from the Rust crate that all libraries are made from: by way of WebAssembly, whose
 * instructions are the statements below. Do not edit it. Results have the same bits as those of the libraries.
 *
 * Compile this file with your program, and define FOOTFALL_GENERIC for it. Without that it is empty except on Xtensa, so that
 * build systems that compile all files of a folder do no harm beside a library. */
#if defined(FOOTFALL_GENERIC) || defined(__XTENSA__)

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "footfall_estimator.h"

#if defined(__FAST_MATH__)
#error "footfall: compile this file without -ffast-math, with which results differ"
#endif
#if FLT_EVAL_METHOD == 1 || FLT_EVAL_METHOD == 2
#error "footfall: compile this file so that float is computed as float, for instance with -mfpmath=sse -msse2"
#endif
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "footfall: this file is for little-endian processors"
#endif

/* A fused multiplication and addition would round once instead of twice. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=off")
#else
#pragma STDC FP_CONTRACT OFF
#endif
#if defined(__GNUC__) && !defined(__clang__)
/* A stack is not initialised. */
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-label"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#endif

typedef uint8_t u8;
typedef int8_t s8;
typedef uint16_t u16;
typedef int16_t s16;
typedef uint32_t u32;
typedef int32_t s32;
typedef uint64_t u64;
typedef int64_t s64;
typedef float f32;

/* Constants, whose addresses are behind the memory of a call. */
@CONSTANTS@
/* Place of a constant, or of a variable of the call. */
static inline const u8 *place(const void *memory, u32 address) {
    return address < CONSTANTS ? (const u8 *)memory + address : constants + (address - CONSTANTS);
}

/* Loads and stores: a name, the type in memory, the type that extends the sign, and the result. */
#define LOAD(name, type, extended, result)                                              \
    static inline result name(const void *memory, u64 address) {                        \
        type value;                                                                     \
        memcpy(&value, place(memory, (u32)address), sizeof value);                      \
        return (result)(extended)value;                                                 \
    }
#define STORE(name, type, from)                                                         \
    static inline void name(void *memory, u64 address, from value) {                    \
        const type stored = (type)value;                                                \
        memcpy((u8 *)memory + (u32)address, &stored, sizeof stored);                    \
    }
LOAD(i32_load, u32, u32, u32)
LOAD(i64_load, u64, u64, u64)
LOAD(f32_load, f32, f32, f32)
LOAD(i32_load8_s, s8, s32, u32)
LOAD(i32_load8_u, u8, u32, u32)
LOAD(i32_load16_s, s16, s32, u32)
LOAD(i32_load16_u, u16, u32, u32)
LOAD(i64_load8_u, u8, u64, u64)
LOAD(i64_load16_u, u16, u64, u64)
LOAD(i64_load32_s, s32, s64, u64)
LOAD(i64_load32_u, u32, u64, u64)
STORE(i32_store, u32, u32)
STORE(i64_store, u64, u64)
STORE(f32_store, f32, f32)
STORE(i32_store8, u8, u32)
STORE(i32_store16, u16, u32)
STORE(i64_store8, u8, u64)
STORE(i64_store16, u16, u64)
STORE(i64_store32, u32, u64)

static inline void memory_copy(void *to, const void *from, u32 to_address, u32 from_address, u32 count) {
    memmove((u8 *)to + to_address, place(from, from_address), count);
}

static inline void memory_fill(void *memory, u32 address, u32 value, u32 count) {
    memset((u8 *)memory + address, (int)(value & 0xFF), count);
}

static inline u32 i32_reinterpret_f32(f32 value) {
    u32 bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline f32 f32_reinterpret_i32(u32 bits) {
    f32 value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

#if defined(__GNUC__)
#define I32_CLZ(x) ((x) ? (u32)__builtin_clzl((unsigned long)(x)) - 8 * (u32)(sizeof(long) - 4) : 32)
#define I64_CLZ(x) ((x) ? (u64)__builtin_clzll(x) : 64)
#else
static inline u32 I32_CLZ(u32 x) {
    u32 zeros = 32;
    for (; x != 0; x >>= 1) zeros--;
    return zeros;
}
static inline u64 I64_CLZ(u64 x) {
    u64 zeros = 64;
    for (; x != 0; x >>= 1) zeros--;
    return zeros;
}
#endif

/* The Rust code proves that no division is by zero and that no place without a way to it is reached. */
#define UNREACHABLE for (;;) continue
#define DIV_U(x, y) ((x) / (y))
#define REM_U(x, y) ((x) % (y))
#define I32_ROTL(x, y) ((x) << ((y) & 31) | (x) >> ((32 - (y)) & 31))
#define I64_ROTL(x, y) ((x) << ((y) & 63) | (x) >> ((64 - (y)) & 63))
#define FUNC_PROLOGUE
#define FUNC_EPILOGUE

static inline f32 wasm_fabsf(f32 value) { return f32_reinterpret_i32(i32_reinterpret_f32(value) & 0x7FFFFFFFU); }

/* Conversions to integers: the nearest one at the ends of the range, and 0 for NaN. */
static inline u32 I32_TRUNC_SAT_U_F32(f32 value) {
    if (!(value > 0.0F)) return 0;
    return value < 4294967296.0F ? (u32)value : UINT32_MAX;
}

static inline u32 I32_TRUNC_SAT_S_F32(f32 value) {
    if (value != value) return 0;
    if (value < -2147483648.0F) return (u32)INT32_MIN;
    return value < 2147483648.0F ? (u32)(s32)value : (u32)INT32_MAX;
}

static inline u64 I64_TRUNC_SAT_U_F32(f32 value) {
    if (!(value > 0.0F)) return 0;
    return value < 18446744073709551616.0F ? (u64)value : UINT64_MAX;
}

