//! Record of a crash, kept in RAM over the reset; and the loader, asked for by two resets soon after each other.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;

use embassy_time::Duration;
use firmware::supervision::{CRASH_WORDS, CrashReason, CrashRecord};

#[repr(transparent)]
struct Retained<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: written by handlers that never return, and used at start, before they can run.
unsafe impl<T> Sync for Retained<T> {}

#[unsafe(link_section = ".uninit.crash")]
static RECORD: Retained<[u32; CRASH_WORDS]> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

#[unsafe(link_section = ".uninit.reset")]
static TAPPED: Retained<u32> = Retained(UnsafeCell::new(MaybeUninit::uninit()));

/// Mark of a reset that was not long ago.
const SOON: u32 = 0x7A9_70A7;

/// Time in which a second reset asks for the loader.
const SECOND_TAP: Duration = Duration::from_millis(300);

/// Takes the previous crash, if there was one. It is returned only once.
pub fn take() -> Option<CrashRecord> {
    let record = RECORD.0.get().cast::<[u32; CRASH_WORDS]>();
    // SAFETY: valid, aligned, and any bits are words; the handlers cannot run yet.
    let words = unsafe { ptr::read_volatile(record) };
    // SAFETY: as above.
    unsafe { ptr::write_volatile(record, [0; CRASH_WORDS]) };
    CrashRecord::from_words(words)
}

/// Starts the loader, a drive on USB, if the button was pressed twice.
pub fn start_loader_if_tapped_twice() {
    let tapped = TAPPED.0.get().cast::<u32>();
    // SAFETY: valid, aligned, any bits are a word, and nothing else uses it.
    let was_soon = unsafe { ptr::read_volatile(tapped) } == SOON;
    // SAFETY: as above.
    unsafe { ptr::write_volatile(tapped, if was_soon { 0 } else { SOON }) };
    if was_soon {
        start_loader();
    }
    embassy_time::block_for(SECOND_TAP);
    // SAFETY: as above.
    unsafe { ptr::write_volatile(tapped, 0) };
}

/// Starts the loader.
pub fn start_loader() -> ! {
    embassy_rp::rom_data::reset_to_usb_boot(0, 0);
    loop {
        cortex_m::asm::nop();
    }
}

fn note_and_reset(reason: CrashReason, program_counter: u32) -> ! {
    let record = CrashRecord { reason, program_counter };
    // SAFETY: valid and aligned, and nothing else runs any more.
    unsafe { ptr::write_volatile(RECORD.0.get().cast(), record.to_words()) };
    reset()
}

/// Restarts the chip, with all peripherals.
pub fn reset() -> ! {
    embassy_rp::pac::WATCHDOG.ctrl().modify(|w| w.set_trigger(true));
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
