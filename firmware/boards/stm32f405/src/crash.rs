//! Record of a crash, kept over the reset: cause and location.
//!
//! The record is in RAM that start-up code does not initialise. A panic or a fault writes it and
//! resets the board; the next start takes it.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RCC;
use firmware::supervision::{CRASH_WORDS, CrashReason, CrashRecord};
use wire::diagnosis::Reset;

/// Previous crash.
#[derive(Clone, Copy, Debug)]
pub struct Crash {
    /// Cause and location. For a panic, the program counter is that of the call that panicked. It is 0 if unknown, as
    /// after a stack overflow.
    pub record: CrashRecord,
    /// Fault status register (CFSR) of a fault; number of an exception without a handler; 0 for a panic.
    pub detail: u32,
}

/// Data kept over the reset.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    /// Valid only if these words are a record. In that case the other fields are valid, too.
    record: [u32; CRASH_WORDS],
    detail: u32,
}

#[repr(transparent)]
struct Retained<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: either handlers that never return write the value, and the start reads it before they can run, or only the
// thread level uses it.
unsafe impl<T> Sync for Retained<T> {}

#[unsafe(link_section = ".uninit.crash")]
static NOTE: Retained<Note> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// Stack of the fault handler, for faults of the stack itself.
#[unsafe(link_section = ".uninit.fault_stack")]
static FAULT_STACK: Retained<[u64; 64]> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// Takes the previous crash, if there was one. It is returned only once.
pub fn take() -> Option<Crash> {
    let note = NOTE.0.get().cast::<Note>();
    // SAFETY: the pointer is valid and aligned, any bits are a note, and the volatile read keeps
    // the compiler from concluding anything from the memory being uninitialised to it.
    let kept = unsafe { ptr::read_volatile(note) };
    // SAFETY: as above.
    unsafe { ptr::write_volatile(&raw mut (*note).record, [0; CRASH_WORDS]) };
    Some(Crash { record: CrashRecord::from_words(kept.record)?, detail: kept.detail })
}

/// Returns the cause of the start from its flags, and clears them.
pub fn take_reset() -> Reset {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset except that of the supply also pulls the pin. The supply's flag stays set if the watchdog resets the
    // chip before the flags are cleared. A rising supply clears the other flags.
    if flags.wdgrstf() || flags.wwdgrstf() {
        Reset::Watchdog
    } else if flags.porrstf() {
        Reset::Power
    } else if flags.sftrstf() {
        Reset::Program
    } else if flags.borrstf() {
        Reset::Power
    } else {
        Reset::Pin
    }
}

/// Number of consecutive resets by the watchdog, and its complement.
#[unsafe(link_section = ".uninit.resets")]
static RESETS: Retained<[u32; 2]> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// Counts this start. Returns the number of consecutive resets by the watchdog since [`forget_watchdog_resets`].
pub fn count_watchdog_resets(reset: Reset) -> u32 {
    // SAFETY: the pointer is valid and aligned, any bits are numbers, and it is used at the thread level alone.
    let [resets, complement] = unsafe { ptr::read_volatile(RESETS.0.get().cast::<[u32; 2]>()) };
    let resets = match reset {
        Reset::Watchdog if complement == !resets => resets.saturating_add(1),
        Reset::Watchdog => 1,
        _ => 0,
    };
    write_watchdog_resets(resets);
    resets
}

/// Resets the count of consecutive resets, because the program works.
pub fn forget_watchdog_resets() {
    write_watchdog_resets(0);
}

fn write_watchdog_resets(resets: u32) {
    // SAFETY: as in `count_watchdog_resets`.
    unsafe { ptr::write_volatile(RESETS.0.get().cast(), [resets, !resets]) };
}

fn note_and_reset(reason: CrashReason, program_counter: u32, detail: u32) -> ! {
    let record = CrashRecord { reason, program_counter };
    let note = Note { record: record.to_words(), detail };
    // SAFETY: the pointer is valid and aligned, and nothing else runs any more.
    unsafe { ptr::write_volatile(NOTE.0.get().cast(), note) };
    cortex_m::asm::dsb();
    SCB::sys_reset()
}

/// Ignores the message, so that the linker drops the texts of all panics, which would take room in the flash. The
/// program counter and the ELF give file and line.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    note_and_reset(CrashReason::Panic, caller(), 0)
}

/// First return address into the program on the stack. It belongs to the function that panicked, or to a function of
/// the core library that it called.
fn caller() -> u32 {
    unsafe extern "C" {
        static __stext: u8;
        static __etext: u8;
        static _stack_start: u8;
    }
    let text = (&raw const __stext) as u32..(&raw const __etext) as u32;
    let mut word_at = cortex_m::register::msp::read() as *const u32;
    let top = &raw const _stack_start;
    while word_at.cast::<u8>() < top {
        // SAFETY: the stack lies between the stack pointer and the stack's start.
        let word = unsafe { ptr::read_volatile(word_at) };
        // Return addresses are odd: the instruction set is Thumb.
        if word & 1 == 1 && text.contains(&word) {
            return word & !1;
        }
        // SAFETY: still at most one past the end of the stack.
        word_at = unsafe { word_at.add(1) };
    }
    0
}

// The handler first switches to its own stack, because the fault may be an exhausted stack. The registers at the fault
// are at the old stack pointer.
core::arch::global_asm!(
    ".section .HardFault.foot, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "mrs r0, msp",
    "ldr r1, ={stack}",
    "add r1, #{size}",
    "mov sp, r1",
    "b {handler}",
    ".size HardFault, . - HardFault",
    stack = sym FAULT_STACK,
    size = const size_of::<[u64; 64]>(),
    handler = sym hard_fault,
);

unsafe extern "C" fn hard_fault(frame: *const u32) -> ! {
    unsafe extern "C" {
        static _stack_start: u8;
        static _stack_end: u8;
    }
    const FRAME_WORDS: usize = 8;
    const PROGRAM_COUNTER: usize = 6;
    let (bottom, top) = ((&raw const _stack_end) as usize, (&raw const _stack_start) as usize);
    let at = frame as usize;
    // SAFETY: the register may be read at any time.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    if at < bottom || at + FRAME_WORDS * size_of::<u32>() > top {
        note_and_reset(CrashReason::HardFault, 0, status);
    }
    // SAFETY: the frame lies in the stack.
    let program_counter = unsafe { ptr::read_volatile(frame.add(PROGRAM_COUNTER)) };
    note_and_reset(CrashReason::HardFault, program_counter, status);
}

/// Handles every exception without a handler of its own, including the loss of the crystal (NMI).
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    note_and_reset(CrashReason::HardFault, 0, number as u32);
}
