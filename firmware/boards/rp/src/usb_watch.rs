//! Detection and reset of a USB controller that hangs.
//!
//! Interference can hang the controller (forums.raspberrypi.com, t=374030): it then sees no further frame until it is
//! reset. On the RP2040 erratum E15 makes that likely; the RP2350 has no known erratum of this kind.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_rp::interrupt::typelevel::{Handler, USBCTRL_IRQ};
use embassy_rp::pac;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};

use crate::wiring::micros;

/// Time without a frame after which the controller is considered hung, µs.
const HUNG_US: u32 = 1_000_000;

/// Interval between checks for a hung controller.
const LOOK: Duration = Duration::from_millis(100);

/// Time for which the pull-up is off, so that the host sees the device disconnect.
const GONE: Duration = Duration::from_millis(100);

/// Time of the last start of a frame, µs.
static FRAME_AT: AtomicU32 = AtomicU32::new(0);

/// Whether a host has configured the device, and has not suspended it.
static IS_CONFIGURED: AtomicBool = AtomicBool::new(false);
static IS_SUSPENDED: AtomicBool = AtomicBool::new(false);

/// Signals a reset of the bus.
pub static BUS_RESET: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Records the time of frames and resets of the bus. It must run before the driver's handler, which masks these
/// interrupts.
pub struct FrameHandler;

impl Handler<USBCTRL_IRQ> for FrameHandler {
    unsafe fn on_interrupt() {
        let pending = pac::USB.ints().read();
        if pending.dev_sof() {
            // Reading the frame number clears the interrupt.
            let _ = pac::USB.sof_rd().read();
            FRAME_AT.store(micros(), Ordering::Relaxed);
        }
        if pending.bus_reset() {
            BUS_RESET.signal(());
        }
    }
}

/// Time since the last start of a frame, µs.
pub fn since_frame() -> u32 {
    // The time of the frame is read first. If a frame came between the two reads, its time would be later
    // than `micros`, and the difference would wrap to an hour.
    let frame_at = FRAME_AT.load(Ordering::Acquire);
    micros().wrapping_sub(frame_at)
}

/// Watches the host.
pub struct Watch;

impl embassy_usb::Handler for Watch {
    fn reset(&mut self) {
        IS_CONFIGURED.store(false, Ordering::Relaxed);
        IS_SUSPENDED.store(false, Ordering::Relaxed);
    }

    fn configured(&mut self, is_configured: bool) {
        FRAME_AT.store(micros(), Ordering::Relaxed);
        IS_CONFIGURED.store(is_configured, Ordering::Relaxed);
    }

    fn suspended(&mut self, is_suspended: bool) {
        FRAME_AT.store(micros(), Ordering::Relaxed);
        IS_SUSPENDED.store(is_suspended, Ordering::Relaxed);
    }
}

/// Enables the interrupt of frames, after the driver has started.
pub fn watch_frames() {
    cortex_m::interrupt::free(|_| pac::USB.inte().modify(|enabled| enabled.set_dev_sof(true)));
}

/// Waits until the controller hangs: no frame comes although a host has configured the device and the bus is not
/// suspended.
pub async fn hung() {
    while !IS_CONFIGURED.load(Ordering::Relaxed)
        || IS_SUSPENDED.load(Ordering::Relaxed)
        || since_frame() < HUNG_US
    {
        Timer::after(LOOK).await;
    }
}

/// Resets the controller. The host sees the device disconnect and connect again.
pub async fn reset_controller() {
    IS_CONFIGURED.store(false, Ordering::Relaxed);
    set_reset(true);
    Timer::after(GONE).await;
    set_reset(false);
    while !pac::RESETS.reset_done().read().usbctrl() {}
}

fn set_reset(is_reset: bool) {
    cortex_m::interrupt::free(|_| pac::RESETS.reset().modify(|w| w.set_usbctrl(is_reset)));
}
