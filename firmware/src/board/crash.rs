//! The record of a crash, which outlives the reset: why and where the program stopped.
//!
//! The record lies in RAM that start-up code leaves alone. A panic or a fault writes it and
//! resets the board; the next start takes it out.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RCC;
use firmware::supervision::{CRASH_WORDS, CrashReason, CrashRecord};

/// The previous crash.
#[derive(Clone, Copy, Debug)]
pub struct Crash {
    /// Why and where. The program counter of a panic is that of the call that panicked; it is 0
    /// where it is not known, as after an overflow of the stack.
    pub record: CrashRecord,
    /// The fault status register (CFSR) of a fault, the number of an exception without
    /// a handler, 0 of a panic.
    pub detail: u32,
}

/// What made the processor start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The supply came, or dipped.
    Power,
    /// The reset pin.
    Pin,
    /// The program, after a crash or by command.
    Software,
    /// The watchdog.
    Watchdog,
}

/// What is kept over the reset.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    /// Believed only if they are a record, and then the rest too.
    record: [u32; CRASH_WORDS],
    detail: u32,
}

#[repr(transparent)]
struct Retained<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: written by handlers that never return and read at start, before there are others.
unsafe impl<T> Sync for Retained<T> {}

#[unsafe(link_section = ".uninit.crash")]
static NOTE: Retained<Note> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// The stack of the fault handler, for faults of the stack itself.
#[unsafe(link_section = ".uninit.fault_stack")]
static FAULT_STACK: Retained<[u64; 64]> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// The previous crash, if there was one. It is returned only once.
pub fn take() -> Option<Crash> {
    let note = NOTE.0.get().cast::<Note>();
    // SAFETY: the pointer is valid and aligned, any bits are a note, and the volatile read keeps
    // the compiler from concluding anything from the memory being uninitialised to it.
    let kept = unsafe { ptr::read_volatile(note) };
    // SAFETY: as above.
    unsafe { ptr::write_volatile(&raw mut (*note).record, [0; CRASH_WORDS]) };
    Some(Crash {
        record: CrashRecord::from_words(kept.record)?,
        detail: kept.detail,
    })
}

/// Why the processor started, as its flags say; they are cleared.
pub fn take_reset() -> Reset {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset but that of the supply also pulls the pin; and the supply's flag stays where the
    // watchdog bit before flags were cleared, while a supply that comes clears the others.
    if flags.wdgrstf() || flags.wwdgrstf() {
        Reset::Watchdog
    } else if flags.porrstf() {
        Reset::Power
    } else if flags.sftrstf() {
        Reset::Software
    } else if flags.borrstf() {
        Reset::Power
    } else {
        Reset::Pin
    }
}

fn note_and_reset(reason: CrashReason, program_counter: u32, detail: u32) -> ! {
    let record = CrashRecord {
        reason,
        program_counter,
    };
    let note = Note {
        record: record.to_words(),
        detail,
    };
    // SAFETY: the pointer is valid and aligned, and nothing else runs any more.
    unsafe { ptr::write_volatile(NOTE.0.get().cast(), note) };
    cortex_m::asm::dsb();
    SCB::sys_reset()
}

/// Ignores the message, so that the linker leaves out the texts of all panics, which are a tenth of the
/// flash. The program counter leads to file and line by way of the ELF.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    note_and_reset(CrashReason::Panic, caller(), 0)
}

/// The first return address into the program on the stack: of the function that panicked, or of one in
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
        // SAFETY: between the stack pointer and the stack's start there is the stack.
        let word = unsafe { ptr::read_volatile(word_at) };
        // Return addresses are odd: the instruction set is Thumb.
        if word & 1 == 1 && text.contains(&word) {
            return word & !1;
        }
        // SAFETY: still at most one past the stack.
        word_at = unsafe { word_at.add(1) };
    }
    0
}

// The handler changes to a stack of its own first, because the fault may be that there is no stack
// left. The registers at the fault lie where the stack pointer was.
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
    let (bottom, top) = (
        (&raw const _stack_end) as usize,
        (&raw const _stack_start) as usize,
    );
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

/// Every exception without a handler of its own, among them the loss of the crystal (NMI).
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    note_and_reset(CrashReason::HardFault, 0, number as u32);
}
