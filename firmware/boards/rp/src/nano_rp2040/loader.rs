//! The loader in the chip's ROM, started by pressing the button twice.
//!
//! A third of a second lies between a press and `main`, because the core copies the program to RAM while it runs from
//! the ring oscillator, at 6.5 MHz. A second press in that time would be lost, so the presses are counted before the
//! copy. The second boot stage calls [`start`], which runs from flash and calls no function in RAM.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr;

use embassy_rp::pac;
use embassy_time::{Duration, Timer};

/// Time from `main` within which a second press starts the loader.
const SECOND_PRESS: Duration = Duration::from_millis(500);

/// Mark of a recent press.
const SOON: u32 = 0x7A9_70A7;

/// Loops that take longer than a button's contact bounces: 10 ms at 6.5 MHz, 6 ms at the oscillator's fastest.
const BOUNCING: u32 = 13_000;

#[repr(transparent)]
struct Mark(UnsafeCell<MaybeUninit<u32>>);

// SAFETY: used by one core at its start, and by one task afterwards.
unsafe impl Sync for Mark {}

#[unsafe(link_section = ".uninit.press")]
static PRESSED: Mark = Mark(UnsafeCell::new(MaybeUninit::uninit()));

/// Vectors that the second boot stage reads: the stack's start, and the function to call.
#[repr(C)]
struct Vectors {
    stack: *const u32,
    start: unsafe extern "C" fn() -> !,
}

// SAFETY: never written.
unsafe impl Sync for Vectors {}

unsafe extern "C" {
    static _stack_start: u32;

    /// Start of the run-time: initialises memory, sets the table of vectors, and calls `main`.
    fn Reset() -> !;
}

#[unsafe(link_section = ".entry.vectors")]
#[used]
static VECTORS: Vectors = Vectors { stack: &raw const _stack_start, start };

/// Starts the loader at the second press of the button, and otherwise the program.
///
/// Only resets by the pin RUN count: a dip of the supply and the watchdog do not.
#[unsafe(link_section = ".entry.start")]
unsafe extern "C" fn start() -> ! {
    let is_by_watchdog = pac::WATCHDOG.reason().read().0 != 0;
    let is_by_button = !is_by_watchdog && pac::VREG_AND_CHIP_RESET.chip_reset().read().had_run();
    // Any other reset forgets the press.
    let is_soon = take_mark() == SOON;
    if is_by_button && is_soon {
        // SAFETY: the ROM holds tables of pointers to functions at fixed addresses (RP2040 data sheet, 2.8.3). `UB` is
        // reset_to_usb_boot.
        unsafe {
            let pointer =
                |at: usize| usize::from(ptr::read_volatile(ptr::without_provenance::<u16>(at)));
            let look_up: extern "C" fn(usize, u32) -> usize = core::mem::transmute(pointer(0x18));
            let code = u32::from(u16::from_le_bytes(*b"UB"));
            let reset_to_usb_boot: extern "C" fn(u32, u32) -> ! =
                core::mem::transmute(look_up(pointer(0x14), code));
            reset_to_usb_boot(0, 0)
        }
    }
    if is_by_button {
        for loops in 0..BOUNCING {
            core::hint::black_box(loops);
        }
        set_mark(SOON);
    }
    // SAFETY: the stack is set, and nothing has been initialised.
    unsafe { Reset() }
}

#[inline(always)]
fn take_mark() -> u32 {
    // SAFETY: valid, aligned, any bits are a word, and nothing else uses it now.
    let mark = unsafe { ptr::read_volatile(PRESSED.0.get().cast()) };
    set_mark(0);
    mark
}

#[inline(always)]
fn set_mark(mark: u32) {
    // SAFETY: as above.
    unsafe { ptr::write_volatile(PRESSED.0.get().cast(), mark) }
}

/// Forgets the press after [`SECOND_PRESS`].
#[embassy_executor::task]
pub async fn forget_press() {
    Timer::after(SECOND_PRESS).await;
    set_mark(0);
}
