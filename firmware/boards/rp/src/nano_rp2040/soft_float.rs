//! Additions and multiplications of f32 under the names that compiled code calls. They are in RAM, because each sample
//! makes a thousand calls.

use core::arch::naked_asm;

use firmware::float::{SIGN, add, multiply};

/// Sum.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fadd(a: u32, b: u32) -> u32 {
    add(a, b)
}

/// Difference.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    add(a, b ^ SIGN)
}

/// Product of two normal numbers, if it is normal too; [`product_of_others`] handles the rest. In assembly, because the
/// compiled version takes longer: of the registers that shift, add and multiply, it spills five to the stack.
///
/// With ah and bh for the upper 16 bits of both fractions, al and bl for the lower 8:
///
/// ```text
/// middle = ah bl + al bh + (al bl >> 8)
/// high = ah bh + (middle >> 8)
/// ```
#[unsafe(no_mangle)]
#[unsafe(naked)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    naked_asm!(
        // Exponents, neither 0 nor 255.
        "lsls r2, r0, #1",
        "lsrs r2, r2, #24",
        "beq 5f",
        "cmp r2, #255",
        "beq 5f",
        "lsls r3, r1, #1",
        "lsrs r3, r3, #24",
        "beq 5f",
        "cmp r3, #255",
        "beq 5f",
        // r2: the exponent less 1, which the carry of a long product may still raise to that of a normal number.
        "adds r2, r2, r3",
        "subs r2, #128",
        "cmp r2, #0xFC",
        "bhi 5f",
        "push {{r4, r5, r6, r7, lr}}",
        // r3: the sign.
        "movs r3, r0",
        "eors r3, r1",
        "lsrs r3, r3, #31",
        "lsls r3, r3, #31",
        // r4: ah, r5: bh, with their first bit; r0: al, r1: bl.
        "movs r7, #1",
        "lsls r7, r7, #15",
        "lsrs r4, r0, #8",
        "uxth r4, r4",
        "orrs r4, r7",
        "lsrs r5, r1, #8",
        "uxth r5, r5",
        "orrs r5, r7",
        "uxtb r0, r0",
        "uxtb r1, r1",
        // r6: al bl, r0: middle, r4: high.
        "movs r6, r0",
        "muls r6, r1, r6",
        "muls r0, r5, r0",
        "muls r1, r4, r1",
        "adds r0, r0, r1",
        "lsrs r1, r6, #8",
        "adds r0, r0, r1",
        "muls r4, r5, r4",
        "lsrs r1, r0, #8",
        "adds r4, r4, r1",
        "bmi 1f",
        // r4: the product with its first bit in bit 31; r1: bits of `middle` below it, in any place.
        "lsls r1, r0, #25",
        "adcs r4, r4",
        "b 2f",
        "1:",
        "adds r2, #1",
        "lsls r1, r0, #24",
        "2:",
        // r5: the fraction, rounded to nearest. The carry is the bit behind it.
        "lsrs r5, r4, #8",
        "bcc 4f",
        "lsls r7, r4, #25",
        "orrs r7, r1",
        "lsls r0, r6, #24",
        "orrs r7, r0",
        "bne 3f",
        // Halfway: even.
        "lsrs r7, r5, #1",
        "bcc 4f",
        "3:",
        "adds r5, #1",
        "4:",
        "lsls r0, r2, #23",
        "adds r0, r0, r5",
        "orrs r0, r3",
        "pop {{r4, r5, r6, r7, pc}}",
        "5:",
        "ldr r2, 6f",
        "bx r2",
        ".p2align 2",
        "6:",
        ".word {others}",
        others = sym product_of_others,
    )
}

/// Product of any two numbers.
extern "C" fn product_of_others(a: u32, b: u32) -> u32 {
    multiply(a, b)
}
