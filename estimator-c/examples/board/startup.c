/* Vector table and reset of a Cortex-M with newlib's semihosting, whose _start sets up the rest. */
#include <stdint.h>

extern uint32_t stack_top;
void _start(void);
void reset(void);

void reset(void) {
#ifdef __ARM_FP
    *(volatile uint32_t *)0xE000ED88 |= 0xFU << 20; /* CPACR: FPU on */
    __asm volatile("dsb\n\tisb");
#endif
    _start();
    for (;;) {
    }
}

/* Ends the program in QEMU, with an error: semihosting's SYS_EXIT for ADP_Stopped_RunTimeErrorUnknown. */
static void fault(void) {
    register uint32_t operation __asm("r0") = 0x18;
    register uint32_t reason __asm("r1") = 0x20023;
    for (;;) {
        __asm volatile("bkpt 0xAB" : : "r"(operation), "r"(reason) : "memory");
    }
}

__attribute__((section(".vectors"), used)) static const struct {
    void *stack;
    void (*handlers[3])(void); /* reset, NMI, hard fault */
} vectors = {&stack_top, {reset, fault, fault}};
