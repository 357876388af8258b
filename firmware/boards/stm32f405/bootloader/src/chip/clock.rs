//! 80 MHz from the crystal, and ticks of 1 ms. Without the board's crystal the chip stays at 16 MHz and does not join
//! the bus.

use stm32_metapac::flash::regs::Acr;
use stm32_metapac::rcc::regs::{Cfgr, Pllcfgr};
use stm32_metapac::rcc::vals::{Hpre, Pllm, Plln, Pllp, Pllq, Pllsrc, Ppre, Sw};
use stm32_metapac::{FLASH, RCC};
use stm32f405_chip::crystal;

use super::CRYSTAL_MHZ;

/// Clock of the processor, Hz.
const PROCESSOR_HZ: u32 = 80_000_000;

/// Clock of the CAN controller, Hz: half of the processor's, close to the maximum of APB1.
pub const CAN_HZ: u32 = PROCESSOR_HZ / 2;

/// Clock of the internal oscillator, Hz.
const INTERNAL_HZ: u32 = crystal::HSI_MHZ * 1_000_000;

/// Input of the PLL, MHz.
const INPUT_MHZ: u32 = 2;

/// Oscillator of the PLL, MHz.
const PLL_MHZ: u32 = 160;

/// Maximum polls until the PLL runs. They take at least 20 ms at 16 MHz.
const POLLS: u32 = 64_000;

/// `RCC_PLLCFGR` after a reset (RM0090, 7.3.2).
const PLLCFGR_AFTER_RESET: u32 = 0x2400_3010;

/// Millisecond ticks.
pub struct Ticks(());

/// Starts crystal and ticks.
pub fn start() -> Ticks {
    let hz = if start_crystal() { PROCESSOR_HZ } else { INTERNAL_HZ };
    // SAFETY: nothing else uses the timer.
    let timer = unsafe { &*cortex_m::peripheral::SYST::PTR };
    // SAFETY: the reload has 24 bits. The control selects the processor's clock and an interrupt, which is masked and
    // only ends a sleep.
    unsafe {
        timer.rvr.write(hz / 1000 - 1);
        timer.cvr.write(0);
        timer.csr.write(0b111);
    }
    Ticks(())
}

/// Starts the board's crystal, and runs the processor from it. Returns whether that succeeds.
fn start_crystal() -> bool {
    crystal::start(CRYSTAL_MHZ).is_ok() && start_pll(Pllsrc::HSE, CRYSTAL_MHZ)
}

/// Runs the processor at 80 MHz from the internal oscillator, so that hashing a program takes a fifth of the time.
pub fn speed_up() {
    start_pll(Pllsrc::HSI, crystal::HSI_MHZ);
}

/// Undoes [`speed_up`], so that a program finds the clocks as after a reset.
pub fn restore_speed() {
    RCC.cfgr().modify(|w| w.set_sw(Sw::HSI));
    while RCC.cfgr().read().sws() != Sw::HSI {}
    RCC.cr().modify(|w| w.set_pllon(false));
    RCC.cfgr().write_value(Cfgr(0));
    RCC.pllcfgr().write_value(Pllcfgr(PLLCFGR_AFTER_RESET));
    FLASH.acr().write_value(Acr(0));
}

/// Runs the processor at 80 MHz from an oscillator of this frequency. Returns whether that succeeds.
fn start_pll(source: Pllsrc, mhz: u32) -> bool {
    RCC.pllcfgr().write(|w| {
        w.set_pllsrc(source);
        w.set_pllm(Pllm::from_bits((mhz / INPUT_MHZ) as u8));
        w.set_plln(Plln::from_bits((PLL_MHZ / INPUT_MHZ) as u16));
        w.set_pllp(Pllp::DIV2);
        // Unused, but 0 is forbidden.
        w.set_pllq(Pllq::DIV4);
    });
    RCC.cr().modify(|w| w.set_pllon(true));
    if !(0..POLLS).any(|_| RCC.cr().read().pllrdy()) {
        return false;
    }
    // Three wait states suffice for 80 MHz from 1.8 V on if the prefetch is off (RM0090, table 10). The supply has not
    // been checked yet.
    FLASH.acr().modify(|w| {
        w.set_latency(stm32_metapac::flash::vals::Latency::WS3);
        w.set_icen(true);
    });
    RCC.cfgr().modify(|w| {
        w.set_hpre(Hpre::DIV1);
        w.set_ppre1(Ppre::DIV2);
        w.set_ppre2(Ppre::DIV1);
        w.set_sw(Sw::PLL1_P);
    });
    (0..POLLS).any(|_| RCC.cfgr().read().sws() == Sw::PLL1_P)
}

/// Returns whether the crystal was started.
pub fn is_crystal() -> bool {
    RCC.cfgr().read().sws() == Sw::PLL1_P
}

/// Returns the clock of the serial line's controller, Hz: that of the processor.
pub fn serial_hz() -> u32 {
    if is_crystal() { PROCESSOR_HZ } else { INTERNAL_HZ }
}

impl Ticks {
    /// Returns whether a tick has passed since the last call. Several ticks count as one.
    pub fn has_passed(&mut self) -> bool {
        const COUNTED: u32 = 1 << 16;
        // SAFETY: reading the register clears the flag. Nothing else uses it.
        unsafe { (*cortex_m::peripheral::SYST::PTR).csr.read() & COUNTED != 0 }
    }
}
