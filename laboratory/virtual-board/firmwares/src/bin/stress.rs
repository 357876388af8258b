//! Nested priorities with floats in every handler, two threads that `PendSV` switches between, and
//! sections under BASEPRI and PRIMASK. Prints the results of all contexts.

#![no_std]
#![no_main]

use board_proofs::Orbit;
use core::cell::UnsafeCell;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SCB, scb};
use cortex_m::register::basepri;
use cortex_m_rt::{entry, exception};
use cortex_m_semihosting::{debug, hprintln};

/// System ticks until the end.
const TICKS: u32 = 3_000;

/// Steps of an orbit in each half of a handler.
const STEPS: u32 = 5;

/// State of one context, by its index: three interrupts, `SysTick`, two threads.
struct Orbits([UnsafeCell<Orbit>; 6]);

// SAFETY: each cell is used by one context only, and read by `main` when all others have ended.
unsafe impl Sync for Orbits {}

static ORBITS: Orbits = Orbits([
    UnsafeCell::new(Orbit::new(0)),
    UnsafeCell::new(Orbit::new(1)),
    UnsafeCell::new(Orbit::new(2)),
    UnsafeCell::new(Orbit::new(3)),
    UnsafeCell::new(Orbit::new(4)),
    UnsafeCell::new(Orbit::new(5)),
]);

/// A counter that every context reads, modifies and writes under a mask.
static SHARED: AtomicU32 = AtomicU32::new(0);
static RUNS: [AtomicU32; 6] = [const { AtomicU32::new(0) }; 6];
static TICK: AtomicU32 = AtomicU32::new(0);
static SWITCHES: AtomicU32 = AtomicU32::new(0);
static NESTED: AtomicU32 = AtomicU32::new(0);
static DEPTH: AtomicU32 = AtomicU32::new(0);
/// Handlers that ran although BASEPRI masked them, and orbits whose bits were lost.
static VIOLATIONS: AtomicU32 = AtomicU32::new(0);

/// Body of a handler; sets the interrupts in `pend` pending half-way.
fn run(context: usize, pend: u32) {
    if DEPTH.fetch_add(1, Ordering::Relaxed) > 0 {
        NESTED.fetch_add(1, Ordering::Relaxed);
    }
    // SAFETY: this cell is this context's own.
    let orbit = unsafe { &mut *ORBITS.0[context].get() };
    // In registers while others interrupt.
    let mut own = *orbit;
    own.advance(STEPS);
    // SAFETY: setting pending bits touches nothing else.
    unsafe { (*NVIC::PTR).ispr[0].write(pend) };
    own.advance(STEPS);
    *orbit = own;
    let runs = &RUNS[context];
    runs.store(runs.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    cortex_m::interrupt::free(|_| {
        let shared = SHARED.load(Ordering::Relaxed);
        SHARED.store(shared + 1, Ordering::Relaxed);
    });
    DEPTH.fetch_sub(1, Ordering::Relaxed);
}

#[repr(C, align(8))]
struct Stack(UnsafeCell<[u32; 512]>);

// SAFETY: only the thread whose stack it is touches it, after `main` has laid out its frame.
unsafe impl Sync for Stack {}

static STACK: Stack = Stack(UnsafeCell::new([0; 512]));

/// The stack pointer of the thread that does not run.
#[unsafe(no_mangle)]
static OTHER: AtomicU32 = AtomicU32::new(0);

fn thread(context: usize) -> bool {
    // SAFETY: this cell is this thread's own.
    let orbit = unsafe { &mut *ORBITS.0[context].get() };
    let mut own = *orbit;
    for _ in 0..5 {
        own.advance(3);
        // While BASEPRI masks the two lower interrupts, they do not run.
        // SAFETY: nothing relies on the masked interrupts.
        unsafe { basepri::write(0x80) };
        let before = [&RUNS[1], &RUNS[2]].map(|runs| runs.load(Ordering::Relaxed));
        own.advance(2);
        let after = [&RUNS[1], &RUNS[2]].map(|runs| runs.load(Ordering::Relaxed));
        // SAFETY: unmasks the interrupts that were masked above.
        unsafe { basepri::write(0) };
        if before != after {
            VIOLATIONS.fetch_add(1, Ordering::Relaxed);
        }
        cortex_m::interrupt::free(|_| {
            let shared = SHARED.load(Ordering::Relaxed);
            own.advance(1);
            SHARED.store(shared + 1, Ordering::Relaxed);
        });
        RUNS[context].fetch_add(1, Ordering::Relaxed);
    }
    *orbit = own;
    TICK.load(Ordering::Relaxed) < TICKS
}

extern "C" fn second_thread() -> ! {
    while thread(5) {}
    loop {
        SCB::set_pendsv();
        cortex_m::asm::wfi();
    }
}

#[entry]
fn main() -> ! {
    // SAFETY: once, at the start.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    let top = STACK.0.get() as u32 + 512 * 4;
    // The frame that PendSV takes for a thread interrupted before its first instruction: R4 to
    // R11, its EXC_RETURN, a pad, then what the hardware pops.
    let frame = top - 4 * (10 + 8);
    // SAFETY: inside the stack, which is not used yet.
    unsafe {
        let words = frame as *mut u32;
        words.add(8).write(0xFFFF_FFFD);
        words.add(16).write(second_thread as *const () as u32);
        words.add(17).write(0x0100_0000);
    }
    OTHER.store(frame, Ordering::Relaxed);

    // SAFETY: priorities before anything is enabled; nothing masks by them yet.
    unsafe {
        core.SCB.set_priority(scb::SystemHandler::SysTick, 0x20);
        core.SCB.set_priority(scb::SystemHandler::PendSV, 0xF0);
        core.NVIC.ipr[28].write(0x40);
        core.NVIC.ipr[29].write(0x80);
        core.NVIC.ipr[30].write(0xC0);
        core.NVIC.iser[0].write(0b111 << 28);
        // Threads run on the process stack; this one keeps the stack that it has.
        let main_stack = cortex_m::register::msp::read() - 4096;
        switch_stacks(main_stack);
    }
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(2_999);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    while thread(4) {}
    core.SYST.disable_interrupt();
    report();
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

/// Goes on with the process stack, and gives handlers the main stack from `main_stack` down.
///
/// # Safety
/// Once, at thread level, with room below `main_stack`, which lies well below the stack so far.
#[inline(always)]
unsafe fn switch_stacks(main_stack: u32) {
    // SAFETY: the stack pointer's value stays the same; only its register becomes another.
    unsafe {
        core::arch::asm!(
            "mov {saved}, sp",
            "msr psp, {saved}",
            "mrs {saved}, control",
            "orr {saved}, {saved}, #2",
            "msr control, {saved}",
            "isb",
            "msr msp, {main}",
            saved = out(reg) _,
            main = in(reg) main_stack,
        );
    }
}

fn report() {
    for (context, orbit) in ORBITS.0.iter().enumerate() {
        // SAFETY: the tick is off and the other thread is not switched to any more.
        let orbit = unsafe { *orbit.get() };
        hprintln!(
            "context {} runs {} steps {} bits {:08x?}",
            context,
            RUNS[context].load(Ordering::Relaxed),
            orbit.steps(),
            orbit.bits()
        );
    }
    let total: u32 = RUNS.iter().map(|runs| runs.load(Ordering::Relaxed)).sum();
    hprintln!(
        "shared {} of {} nested {} switches {} violations {}",
        SHARED.load(Ordering::Relaxed),
        total,
        NESTED.load(Ordering::Relaxed),
        SWITCHES.load(Ordering::Relaxed),
        VIOLATIONS.load(Ordering::Relaxed)
    );
}

#[exception]
fn SysTick() {
    let tick = TICK.load(Ordering::Relaxed);
    if tick < TICKS {
        TICK.store(tick + 1, Ordering::Relaxed);
        // A pattern in which every handler interrupts all lower ones.
        let mut pend = 0;
        if tick.is_multiple_of(2) {
            pend |= 1 << 30;
        }
        if tick.is_multiple_of(3) {
            pend |= 1 << 29;
        }
        if tick.is_multiple_of(5) {
            pend |= 1 << 28;
        }
        // SAFETY: setting pending bits touches nothing else.
        unsafe { (*NVIC::PTR).ispr[0].write(pend) };
        if tick.is_multiple_of(7) {
            SWITCHES.fetch_add(1, Ordering::Relaxed);
            SCB::set_pendsv();
        }
    }
    run(3, 0);
}

#[exception]
unsafe fn DefaultHandler(irqn: i16) {
    match irqn {
        28 => run(0, 0),
        29 => run(1, 1 << 28),
        30 => run(2, 1 << 29),
        _ => {
            VIOLATIONS.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Switches between the two threads: pushes what the hardware does not, swaps stacks, pops.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn PendSV() {
    core::arch::naked_asm!(
        "mrs r0, psp",
        "tst lr, #0x10",
        "it eq",
        "vstmdbeq r0!, {{s16-s31}}",
        "sub r0, r0, #4",
        "stmdb r0!, {{r4-r11, lr}}",
        "ldr r1, =OTHER",
        "ldr r2, [r1]",
        "str r0, [r1]",
        "ldmia r2!, {{r4-r11, lr}}",
        "add r2, r2, #4",
        "tst lr, #0x10",
        "it eq",
        "vldmiaeq r2!, {{s16-s31}}",
        "msr psp, r2",
        "bx lr",
    );
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::nop();
    }
}
