//! Detection of a supply too low for the flash: the programmable voltage detector (RM0090, 5.2.3).

use embassy_stm32::pac::PWR;

/// 2.7 V, required for writing flash by words. The part's own threshold lies between 2.65 and 2.92 V
/// with a falling supply (DS8626, table 20 \[M\]).
const LEVEL_2_7_V: u8 = 0b101;

/// Starts the detector.
pub fn watch() {
    PWR.cr1().modify(|w| {
        w.set_pls(LEVEL_2_7_V);
        w.set_pvde(true);
    });
}

/// Returns whether the supply is below the threshold.
pub fn is_low() -> bool {
    PWR.csr1().read().pvdo()
}
