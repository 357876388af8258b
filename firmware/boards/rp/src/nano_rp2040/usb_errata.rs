//! Workarounds for errata of the chip's USB controller (RP2040 data sheet) that its driver lacks.
//!
//! | erratum | effect | workaround |
//! |---|---|---|
//! | RP2040-E5, chips B0 and B1 | behind a busy hub the device does not leave the reset of the bus | [`connect`] |
//! | RP2040-E15 | a corrupted packet hangs the controller: it sees no further frame until it is reset | [`is_early`] makes it rarer, [`usb_watch`](crate::usb_watch) detects and ends it |
//!
//! The workarounds follow pico-sdk (`rp2040_usb_device_enumeration.c`) and TinyUSB (`rp2040_usb.c`,
//! `e15_is_critical_frame_period`).

use embassy_rp::pac;
use embassy_rp::pac::io::vals::{Inover, Oeover};
use embassy_time::{Duration, Timer};

use crate::usb_watch::{BUS_RESET, since_frame};

/// Period of the host's frames, µs.
const FRAME_US: u32 = 1_000;

/// First part of a frame, µs. At the end of a frame the controller does not recover from a corrupted packet that it
/// takes for an acknowledgement.
const EARLY_US: u32 = 800;

/// Interval between checks for the end of a bus reset, and duration of a forced idle state: a little more than 0.8 ms.
const STEP: Duration = Duration::from_millis(1);

/// Maximum number of steps until the controller has connected.
const CONNECTING: u32 = 10;

/// State of the lines while the host resets the bus: both low.
const RESETTING: u8 = 0;

/// Pin whose input path can replace D+ (D3 of the board), and the function of such a pin.
const DP_PIN: usize = 15;
const DEBUG_USB: u8 = 8;

/// Returns whether a frame is in its first part.
pub fn is_early() -> bool {
    since_frame() % FRAME_US < EARLY_US
}

/// Waits for the first part of the next frame.
pub async fn until_early() {
    let left = FRAME_US - since_frame() % FRAME_US;
    Timer::after_micros(u64::from(left)).await;
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
