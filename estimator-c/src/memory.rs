//! Functions of Arm's run-time ABI that copy and clear memory, to which the compiler generates calls: by `memcpy`, `memmove` and
//! `memset`. A program without a C library has to define those anyway, because GCC calls them, but not these.

use core::arch::global_asm;

// SAFETY: These are the functions of the ABI (AAPCS: arguments in r0 to r2, r3 is free). The definitions are weak, so that those
// of a program's C library win where it has linked them. The address is loaded, since a branch of a Cortex-M0 reaches only 2 KiB.
global_asm!(
    ".syntax unified",
    ".macro footfall_memory name",
    ".weak \\name, \\name\\()4, \\name\\()8",
    ".type \\name, %function",
    ".type \\name\\()4, %function",
    ".type \\name\\()8, %function",
    "\\name:",
    "\\name\\()4:",
    "\\name\\()8:",
    ".endm",
    ".section .text.__aeabi_memcpy, \"ax\", %progbits",
    ".p2align 2",
    "footfall_memory __aeabi_memcpy",
    "ldr r3, 1f",
    "bx r3",
    ".p2align 2",
    "1: .word memcpy",
    ".section .text.__aeabi_memmove, \"ax\", %progbits",
    ".p2align 2",
    "footfall_memory __aeabi_memmove",
    "ldr r3, 1f",
    "bx r3",
    ".p2align 2",
    "1: .word memmove",
    // The value and the size are exchanged between the two ABIs.
    ".section .text.__aeabi_memset, \"ax\", %progbits",
    ".p2align 2",
    "footfall_memory __aeabi_memset",
    "mov r3, r1",
    "mov r1, r2",
    "mov r2, r3",
    "ldr r3, 1f",
    "bx r3",
    ".p2align 2",
    "1: .word memset",
    ".section .text.__aeabi_memclr, \"ax\", %progbits",
    ".p2align 2",
    "footfall_memory __aeabi_memclr",
    "mov r2, r1",
    "movs r1, #0",
    "ldr r3, 1f",
    "bx r3",
    ".p2align 2",
    "1: .word memset",
    ".text",
);
