//! Workarounds for errata of the chip's USB controller (RP2040 data sheet) that its driver lacks.
//!
//! | erratum | effect | workaround |
//! |---|---|---|
//! | RP2040-E5, chips B0 and B1 | behind a busy hub the device does not leave the reset of the bus | [`connect`] |
//! | RP2040-E15 | a corrupted packet hangs the controller: it sees no further frame until it is reset | [`is_early`] makes it rarer, [`hung`] detects it, [`reset_controller`] ends it |
//!
//! The workarounds follow pico-sdk (`rp2040_usb_device_enumeration.c`) and TinyUSB (`rp2040_usb.c`,
//! `e15_is_critical_frame_period`). Interference can hang the controller at other times than the erratum names
//! (forums.raspberrypi.com, t=374030). [`hung`] and [`reset_controller`] are for that.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_rp::interrupt::typelevel::{Handler, USBCTRL_IRQ};
use embassy_rp::pac;
use embassy_rp::pac::io::vals::{Inover, Oeover};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};

/// Period of the host's frames, µs.
const FRAME_US: u32 = 1_000;

/// First part of a frame, µs. At the end of a frame the controller does not recover from a corrupted packet that it
/// takes for an acknowledgement.
const EARLY_US: u32 = 800;

/// Time without a frame after which the controller is considered hung, µs.
const HUNG_US: u32 = 1_000_000;

/// Interval between checks for a hung controller.
const LOOK: Duration = Duration::from_millis(100);

/// Time for which the pull-up is off, so that the host sees the device disconnect.
const GONE: Duration = Duration::from_millis(100);

/// Interval between checks for the end of a bus reset, and duration of a forced idle state: a little more than 0.8 ms.
const STEP: Duration = Duration::from_millis(1);

/// Maximum number of steps until the controller has connected.
const CONNECTING: u32 = 10;

/// State of the lines while the host resets the bus: both low.
const RESETTING: u8 = 0;

/// Pin whose input path can replace D+ (D3 of the board), and the function of such a pin.
const DP_PIN: usize = 15;
const DEBUG_USB: u8 = 8;

/// Time of the last start of a frame, µs.
static FRAME_AT: AtomicU32 = AtomicU32::new(0);

/// Whether a host has configured the device, and has not suspended it.
static IS_CONFIGURED: AtomicBool = AtomicBool::new(false);
static IS_SUSPENDED: AtomicBool = AtomicBool::new(false);

static BUS_RESET: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Records the time of frames and resets of the bus. It must run before the driver's handler, which masks these
/// interrupts.
pub struct FrameHandler;

impl Handler<USBCTRL_IRQ> for FrameHandler {
    unsafe fn on_interrupt() {
        let pending = pac::USB.ints().read();
        if pending.dev_sof() {
            // Reading the frame number clears the interrupt.
            let _ = pac::USB.sof_rd().read();
            FRAME_AT.store(now(), Ordering::Relaxed);
        }
        if pending.bus_reset() {
            BUS_RESET.signal(());
        }
    }
}

/// Low word of the time, µs.
fn now() -> u32 {
    pac::TIMER.timerawl().read()
}

fn since_frame() -> u32 {
    now().wrapping_sub(FRAME_AT.load(Ordering::Relaxed))
}

/// Watches the host.
pub struct Watch;

impl embassy_usb::Handler for Watch {
    fn reset(&mut self) {
        IS_CONFIGURED.store(false, Ordering::Relaxed);
        IS_SUSPENDED.store(false, Ordering::Relaxed);
    }

    fn configured(&mut self, is_configured: bool) {
        FRAME_AT.store(now(), Ordering::Relaxed);
        IS_CONFIGURED.store(is_configured, Ordering::Relaxed);
    }

    fn suspended(&mut self, is_suspended: bool) {
        FRAME_AT.store(now(), Ordering::Relaxed);
        IS_SUSPENDED.store(is_suspended, Ordering::Relaxed);
    }
}

/// Enables the interrupt of frames, after the driver has started.
pub fn watch_frames() {
    cortex_m::interrupt::free(|_| pac::USB.inte().modify(|enabled| enabled.set_dev_sof(true)));
}

/// Returns whether a frame is in its first part.
pub fn is_early() -> bool {
    since_frame() % FRAME_US < EARLY_US
}

/// Waits for the first part of the next frame.
pub async fn until_early() {
    let left = FRAME_US - since_frame() % FRAME_US;
    Timer::after_micros(u64::from(left)).await;
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

/// Connects after each reset of the bus, forever.
///
/// After a reset of the bus the controller waits for 0.8 ms of idle lines before it connects. It never sees them while
/// packets to other devices pass. The workaround shows it an idle state through the input path of a pin.
pub async fn connect() {
    // Chips B0 and B1 report revision 1.
    let is_needed = pac::SYSINFO.chip_id().read().revision() == 1;
    loop {
        BUS_RESET.wait().await;
        if !is_needed {
            continue;
        }
        Timer::after(STEP).await;
        while line_state() == RESETTING {
            Timer::after(STEP).await;
        }
        force_idle().await;
    }
}

fn line_state() -> u8 {
    pac::USB.sie_status().read().line_state()
}

async fn force_idle() {
    let control = pac::IO_BANK0.gpio(DP_PIN).ctrl();
    let pad = pac::PADS_BANK0.gpio(DP_PIN);
    let (control_before, pad_before) = (control.read(), pad.read());
    // The pin keeps its setting, and is not driven.
    pad.modify(|w| {
        w.set_pue(true);
        w.set_pde(true);
    });
    control.modify(|w| w.set_oeover(Oeover::DISABLE));
    control.modify(|w| w.set_funcsel(DEBUG_USB));
    // D+ is high. D- is low, because no pin replaces it.
    control.modify(|w| w.set_inover(Inover::HIGH));
    // Keeps the pull-up on while the lines are disconnected from the transceiver.
    pac::USB.usbphy_direct().modify(|w| w.set_dp_pullup_en(true));
    pac::USB.usbphy_direct_override().modify(|w| w.set_dp_pullup_en_override_en(true));
    pac::USB.usb_muxing().write(|w| {
        w.set_to_digital_pad(true);
        w.set_softcon(true);
    });
    for _ in 0..CONNECTING {
        Timer::after(STEP).await;
        if pac::USB.sie_status().read().connected() {
            break;
        }
    }
    pac::USB.usb_muxing().write(|w| {
        w.set_to_phy(true);
        w.set_softcon(true);
    });
    pac::USB.usbphy_direct_override().modify(|w| w.set_dp_pullup_en_override_en(false));
    control.write_value(control_before);
    pad.write_value(pad_before);
}
