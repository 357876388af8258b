//! Record of a crash, kept in RAM over the reset.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;

use embassy_rp::pac;
use firmware::supervision::{CRASH_WORDS, CrashReason, CrashRecord};

use crate::board;

#[repr(transparent)]
struct Retained(UnsafeCell<MaybeUninit<[u32; CRASH_WORDS]>>);

// SAFETY: written by handlers that never return, and used at start, before they can run.
unsafe impl Sync for Retained {}

#[unsafe(link_section = ".uninit.crash")]
static RECORD: Retained = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// Takes the previous crash, if there was one. It is returned only once.
pub fn take() -> Option<CrashRecord> {
    let record = RECORD.0.get().cast::<[u32; CRASH_WORDS]>();
    // SAFETY: valid, aligned, and any bits are words; the handlers cannot run yet.
    let words = unsafe { ptr::read_volatile(record) };
    // SAFETY: as above.
    unsafe { ptr::write_volatile(record, [0; CRASH_WORDS]) };
    CrashRecord::from_words(words)
}

fn note_and_reset(reason: CrashReason, program_counter: u32) -> ! {
    let record = CrashRecord { reason, program_counter };
    // SAFETY: valid and aligned, and nothing else runs any more.
    unsafe { ptr::write_volatile(RECORD.0.get().cast(), record.to_words()) };
    reset()
}

/// Lets the watchdog reset everything but both oscillators. It resets only selected parts.
pub fn select_all() {
    pac::PSM.wdsel().write(|selected| selected.0 = board::ALL_BUT_OSCILLATORS);
}

/// Restarts the chip with all peripherals, even before the watchdog runs.
pub fn reset() -> ! {
    select_all();
    pac::WATCHDOG.ctrl().modify(|w| w.set_trigger(true));
    loop {
        cortex_m::asm::nop();
    }
}

/// Ignores the message, so that the linker drops the texts.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    note_and_reset(CrashReason::Panic, 0)
}

#[cortex_m_rt::exception]
unsafe fn HardFault(frame: &cortex_m_rt::ExceptionFrame) -> ! {
    note_and_reset(CrashReason::HardFault, frame.pc())
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) {
    note_and_reset(CrashReason::HardFault, 0)
}
