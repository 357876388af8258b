//! Detection of a supply too low for the flash: the programmable voltage detector (RM0090, 5.2.3).

use stm32_metapac::{PWR, RCC};

/// 2.7 V, required for writing flash by words (RM0090, 3.6). The part's own threshold is between 2.65 and 2.92 V with a
/// falling supply (DS8626, table 20 \[M\]).
const LEVEL_2_7_V: u8 = 0b101;

/// Starts the detector.
pub fn watch() {
    RCC.apb1enr().modify(|w| w.set_pwren(true));
    // A write just after the clock is enabled can be lost (ES0182, delay after an RCC peripheral clock enabling \[M\]).
    let _ = RCC.apb1enr().read();
    PWR.cr1().modify(|w| {
        w.set_pls(LEVEL_2_7_V);
        w.set_pvde(true);
    });
}

/// Stops the detector, as after a reset.
pub fn forget() {
    PWR.cr1().modify(|w| {
        w.set_pls(0);
        w.set_pvde(false);
    });
    RCC.apb1enr().modify(|w| w.set_pwren(false));
}

/// Returns whether the supply is below the threshold.
pub fn is_low() -> bool {
    PWR.csr1().read().pvdo()
}
