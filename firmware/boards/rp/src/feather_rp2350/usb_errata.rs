//! The RP2350 fixes all errata of the RP2040's USB controller (RP2350 data sheet, 12.7.2.1). RP2350-E12 asks for a core
//! clock at least 10 % above the controller's 48 MHz. Nothing is to be worked around.

use core::future::pending;

/// Returns whether a packet may be prepared now: always.
pub const fn is_early() -> bool {
    true
}

/// Waits until a packet may be prepared.
pub async fn until_early() {}

/// The controller connects by itself.
pub async fn connect() {
    pending().await
}
