//! The chip around the core: its peripherals, the parts soldered to it, and the data between them.
//!
//! | step | where |
//! |---|---|
//! | the core loads or stores: which peripheral is at the address | `access` |
//! | reset and clock control: clocks on and off, consequences of a change | here |
//! | time passes: every peripheral acts when it is due, [`Chip::advance`] | here |
//! | bytes to and from the sensor, edges of its pin | `sensor` |
//! | requests of DMA are served | `dma` |
//! | interrupt lines, and pins that a peripheral needs | here |

mod access;
mod dma;
mod sensor;

use lsm6dsox::sim::Part as Sensor;

use crate::emulator::core::debugger::Dbgmcu;
use crate::emulator::core::nvic::Nvic;
use crate::emulator::corner::Corner;
use crate::emulator::memory::Memory;
use crate::emulator::part::adc::Adc;
use crate::emulator::part::can::Can;
use crate::emulator::part::dma::Dma;
use crate::emulator::part::flash::{FlashRegisters, Protection};
use crate::emulator::part::gpio::Gpio;
use crate::emulator::part::iwdg::Iwdg;
use crate::emulator::part::pwr::Pwr;
use crate::emulator::part::rcc::{Rcc, ResetCause};
use crate::emulator::part::spi::Spi;
use crate::emulator::part::tim11::Tim11;
use crate::emulator::part::timer::Timer;
use crate::emulator::part::usart::Usart;
use crate::emulator::time::{NEVER, cycle};
use crate::emulator::wiring::{Connection, Wiring};
use access::MAP;
pub use sensor::Transaction;

/// The nominal supply, mV.
pub const NOMINAL_MV: u32 = 3_300;

/// The crystal on the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crystal {
    /// The crystal of the board.
    #[default]
    Fitted,
    /// Another one, of this frequency, Hz.
    Hertz(u32),
    /// One that does not start.
    Missing,
    /// The crystal of the board, whose divided clock does not reach the timer that measures it. RM0090 does not say
    /// whether this clock runs before the RTC selects it.
    NotMeasurable,
}

/// Variant of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChipOptions {
    /// The crystal.
    pub crystal: Crystal,
    /// Brown-out level in the option bytes at power-up: 0 as delivered, 3 as set by the board's first start.
    pub brown_out_level: u8,
    /// Write protection in the option bytes at power-up.
    pub protection: Protection,
    /// The specimen, within the limits of the data sheet.
    pub corner: Corner,
}

impl Default for ChipOptions {
    /// Returns a typical chip with the crystal of its board.
    fn default() -> Self {
        Self {
            crystal: Crystal::Fitted,
            brown_out_level: 3,
            protection: Protection::default(),
            corner: Corner::default(),
        }
    }
}

/// The chip's peripherals and the parts soldered to it.
pub struct Chip {
    /// Reset and clocks.
    pub rcc: Rcc,
    /// The flash interface.
    pub flash: FlashRegisters,
    /// The CAN controller with its bus.
    pub can: Can,
    /// USART1, 2, 3 and 6 with their lines.
    pub usarts: [Usart; 4],
    /// The converter with its inputs.
    pub adc: Adc,
    /// Ports A to I.
    pub ports: [Gpio; 9],
    /// Pins that the other parts are soldered to.
    pub wiring: &'static Wiring,
    /// The sensor.
    pub sensor: Option<Sensor>,
    /// Time of the last rising edge of the sensor's pin.
    pub data_ready: Option<u64>,
    /// Transactions with the sensor; `None` while they are not recorded.
    pub transactions: Option<Vec<Transaction>>,
    /// Resets of the chip: time and cause.
    pub resets: Vec<(u64, ResetCause)>,
    /// Streams of DMA2 that have an error in the middle of each transfer.
    pub failing_streams: [bool; 8],
    pwr: Pwr,
    dmas: [Dma; 2],
    spis: [Spi; 3],
    /// TIM2 to TIM5.
    pub(crate) timers: [Timer; 4],
    tim11: Tim11,
    iwdg: Iwdg,
    pub(crate) selected: bool,
    pin_high: bool,
    sensor_edge: u64,
    /// Cause of the reset that is due.
    pub(crate) reset_cause: Option<ResetCause>,
    /// Whether memory has lost its content.
    pub(crate) power_lost: bool,
}

impl Chip {
    /// Creates a chip on a board, just powered up.
    #[must_use]
    pub fn new(options: ChipOptions, wiring: &'static Wiring, sensor: Option<Sensor>) -> Self {
        let crystal = match options.crystal {
            Crystal::Fitted | Crystal::NotMeasurable => Some(wiring.crystal),
            Crystal::Hertz(hertz) => Some(hertz),
            Crystal::Missing => None,
        };
        let mut rcc = Rcc::new(crystal, options.corner);
        rcc.is_measurable = options.crystal != Crystal::NotMeasurable;
        let clocks = rcc.clocks;
        let period = cycle(clocks.timers1);
        let mut ports: [Gpio; 9] = core::array::from_fn(Gpio::new);
        let pin = wiring.data_ready;
        ports[pin.port].driven = u16::from(sensor.is_some()) << pin.number;
        let mut adc = Adc::new();
        adc.set_supply(NOMINAL_MV);
        Self {
            can: Can::new(clocks.pclk1),
            rcc,
            flash: FlashRegisters::new(options.corner)
                .with_brown_out_level(options.brown_out_level)
                .with_protection(options.protection),
            usarts: core::array::from_fn(|_| Usart::new()),
            adc,
            ports,
            wiring,
            sensor,
            data_ready: None,
            transactions: None,
            resets: Vec::new(),
            failing_streams: [false; 8],
            pwr: Pwr::default(),
            dmas: Default::default(),
            spis: core::array::from_fn(|_| Spi::new()),
            timers: [
                Timer::new("TIM2", 32, period),
                Timer::new("TIM3", 16, period),
                Timer::new("TIM4", 16, period),
                Timer::new("TIM5", 32, period),
            ],
            tim11: Tim11::default(),
            iwdg: Iwdg::new(options.corner.lsi_hz()),
            selected: false,
            pin_high: false,
            sensor_edge: NEVER,
            reset_cause: None,
            power_lost: false,
        }
    }

    /// Resets the chip for the cause that was noted.
    pub fn reset(&mut self, now: u64) {
        let cause = self.reset_cause.take().unwrap_or(ResetCause::Pin);
        self.resets.push((now, cause));
        self.rcc.reset(cause);
        self.flash.reset();
        let clocks = self.rcc.clocks;
        self.can.reset(clocks.pclk1, now);
        self.usarts.iter_mut().for_each(Usart::reset);
        self.adc.reset();
        self.ports.iter_mut().for_each(Gpio::reset);
        self.pwr = Pwr::default();
        self.dmas = Default::default();
        self.spis.iter_mut().for_each(Spi::reset);
        self.tim11 = Tim11::default();
        for timer in &mut self.timers {
            timer.reset(cycle(clocks.timers1));
        }
        self.iwdg.reset();
        self.update_select(now);
        self.with_sensor(now, Sensor::host_reset);
    }

    /// Resets the chip from outside. A dip of the supply also clears memory and resets the sensor.
    pub fn request_reset(&mut self, cause: ResetCause) {
        self.reset_cause = Some(cause);
        if matches!(cause, ResetCause::BrownOut | ResetCause::PowerOn) {
            self.power_lost = true;
            if let Some(sensor) = &mut self.sensor {
                sensor.inject(lsm6dsox::sim::PartFault::Reset);
            }
        }
    }

    /// Sets the supply, mV: below the brown-out level of the option bytes the chip is reset, and the supply then
    /// returns.
    pub fn set_supply(&mut self, mv: u32) {
        self.flash.supply_mv = mv;
        if mv < self.flash.brown_out_mv() {
            self.flash.supply_mv = NOMINAL_MV;
            self.request_reset(ResetCause::BrownOut);
        }
        self.adc.set_supply(self.flash.supply_mv);
    }

    /// A debugger halts or resumes the core. The peripherals selected in `DBGMCU` stop while it is halted.
    pub(crate) fn freeze(&mut self, frozen: bool, debug: &Dbgmcu, now: u64) {
        for (index, timer) in self.timers.iter_mut().enumerate() {
            timer.freeze(frozen && debug.freezes_timer(index), now);
        }
        self.iwdg.freeze(frozen && debug.freezes_watchdog(), now);
    }

    /// Whether a reset is due.
    pub(crate) fn take_reset_request(&mut self) -> bool {
        if core::mem::take(&mut self.flash.cut) {
            self.flash.cut_at = None;
            self.request_reset(ResetCause::PowerOn);
        }
        self.reset_cause.is_some()
    }

    /// Time of the next event.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        if self.rcc.stopped {
            return self.iwdg.next_event();
        }
        let timers = self.timers.iter().map(Timer::next_event);
        let spis = self.spis.iter().map(Spi::next_event);
        let usarts = self.usarts.iter().map(Usart::next_event);
        let others = [self.can.next_event(), self.iwdg.next_event(), self.sensor_edge];
        let all = timers.chain(spis).chain(usarts).chain(others);
        all.min().unwrap_or(NEVER)
    }

    /// Processes all events that are due.
    ///
    /// # Errors
    /// If something is used that is not modelled.
    pub fn advance(&mut self, memory: &mut dyn Memory, now: u64) -> Result<(), String> {
        loop {
            // One at a time in order of time, as DMA may start the next.
            let due = self.next_event();
            let at = due.min(now);
            self.advance_parts(at);
            self.serve_dma(memory, at)?;
            if due > now || self.reset_cause.is_some() && self.next_event() == due {
                return Ok(());
            }
        }
    }

    fn advance_parts(&mut self, now: u64) {
        if self.iwdg.next_event() <= now {
            self.iwdg.reset();
            self.reset_cause = Some(ResetCause::Watchdog);
        }
        if self.rcc.stopped {
            return;
        }
        self.advance_sensor(now);
        for timer in &mut self.timers {
            if timer.next_event() <= now {
                timer.advance(now);
            }
        }
        for index in 0..self.spis.len() {
            let pclk = self.spi_clock(index);
            if let Some(out) = self.spis[index].take_frame(now) {
                let answer = if index == self.wiring.spi { self.exchange(out, now) } else { 0xFF };
                self.spis[index].finish_frame(answer, now, pclk);
            }
        }
        for index in 0..self.usarts.len() {
            let pclk = self.usart_clock(index);
            if self.usarts[index].next_event() <= now {
                self.usarts[index].advance(now, pclk);
            }
        }
        self.can.advance(now);
        self.adc.advance(now);
    }
}

/// Clocks of the peripherals, and the consequences of their change.
impl Chip {
    /// Period of the core's clock.
    #[must_use]
    pub const fn period(&self) -> u64 {
        cycle(self.rcc.clocks.hclk)
    }

    /// The clock of an SPI controller, hertz.
    pub(super) const fn spi_clock(&self, index: usize) -> u32 {
        match index {
            0 => self.rcc.clocks.pclk2,
            _ => self.rcc.clocks.pclk1,
        }
    }

    /// The clock of a serial line, hertz.
    #[must_use]
    pub const fn usart_clock(&self, index: usize) -> u32 {
        match index {
            0 | 3 => self.rcc.clocks.pclk2,
            _ => self.rcc.clocks.pclk1,
        }
    }

    /// A store to reset and clock control.
    pub(super) fn write_rcc(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        let before = self.rcc.clocks;
        self.rcc.write(offset, value, now, self.flash.wait_states())?;
        if self.rcc.clocks != before {
            self.check_flash_at_supply()?;
            self.follow_clocks(now);
        }
        // Reset registers lie 0x20 below the enables.
        if matches!(offset, 0x10 | 0x20 | 0x24) {
            for entry in &MAP {
                if let Some((register, bit)) = entry.enable
                    && register == offset + 0x20
                    && value & 1 << bit != 0
                {
                    self.reset_part(entry.part, now);
                }
            }
        }
        Ok(())
    }

    /// Checks wait states and prefetch of the flash for the supply (RM0090, table 10). A supply that falls later goes
    /// unnoticed.
    ///
    /// # Errors
    /// If there are too few wait states, or the prefetch is on below 2.1 V.
    pub(super) fn check_flash_at_supply(&self) -> Result<(), String> {
        let supply_mv = self.flash.supply_mv;
        let hertz_a_state = match supply_mv {
            2_700.. => 30_000_000,
            2_400.. => 24_000_000,
            2_100.. => 22_000_000,
            _ => 20_000_000,
        };
        self.rcc
            .check_wait_states(self.flash.wait_states(), hertz_a_state)
            .map_err(|error| format!("{error} at {supply_mv} mV"))?;
        if supply_mv < 2_100 && self.flash.prefetches() {
            return Err(format!("flash is prefetched at {supply_mv} mV"));
        }
        Ok(())
    }

    /// Updates the clocks of timers and CAN.
    fn follow_clocks(&mut self, now: u64) {
        let clocks = self.rcc.clocks;
        for timer in &mut self.timers {
            timer.set_period(now, cycle(clocks.timers1));
        }
        self.can.pclk = clocks.pclk1;
    }

    /// Stops the crystal. Returns whether an NMI is due.
    ///
    /// # Errors
    /// As [`Rcc::lose_crystal`].
    pub(crate) fn lose_crystal(&mut self, now: u64) -> Result<bool, String> {
        let watched = self.rcc.lose_crystal(now, self.flash.wait_states())?;
        self.follow_clocks(now);
        Ok(watched)
    }
}

/// Interrupt line of each peripheral (RM0090, table 62).
const TIMER_INTERRUPTS: [u16; 4] = [28, 29, 30, 50];
const SPI_INTERRUPTS: [u16; 3] = [35, 36, 51];
const USART_INTERRUPTS: [u16; 4] = [37, 38, 39, 71];
const CAN_INTERRUPTS: [u16; 4] = [19, 20, 21, 22];
const DMA_INTERRUPTS: [[u16; 8]; 2] =
    [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];

impl Chip {
    /// Drives the levels of all interrupt lines.
    pub(crate) fn drive_lines(&self, nvic: &mut Nvic) {
        let mut levels = 0;
        let mut set = |line: u16, level: bool| levels |= u128::from(level) << line;
        for (timer, line) in self.timers.iter().zip(TIMER_INTERRUPTS) {
            set(line, timer.interrupts());
        }
        for (spi, line) in self.spis.iter().zip(SPI_INTERRUPTS) {
            set(line, spi.interrupts());
        }
        for (usart, line) in self.usarts.iter().zip(USART_INTERRUPTS) {
            set(line, usart.interrupts());
        }
        for (level, line) in self.can.lines().into_iter().zip(CAN_INTERRUPTS) {
            set(line, level);
        }
        for (dma, lines) in self.dmas.iter().zip(DMA_INTERRUPTS) {
            for (stream, line) in dma.streams.iter().zip(lines) {
                set(line, stream.interrupts());
            }
        }
        set(4, self.flash.interrupts());
        nvic.set_lines(levels);
    }
}

/// Pins that a peripheral needs: a program that uses it without them fails the run, with the name of the pin.
impl Chip {
    /// Checks that pins are connected to their peripheral.
    pub(super) fn check_connections(&self, connections: &[Connection]) -> Result<(), String> {
        match connections.iter().find(|made| !made.is_made(&self.ports)) {
            None => Ok(()),
            Some(missing) => Err(format!(
                "{} is used, and {} is not connected to it",
                missing.name,
                missing.pin.name()
            )),
        }
    }

    /// Checks that no pin is driven that the board connects to a supply.
    pub(super) fn check_tied_pins(&self, port: usize) -> Result<(), String> {
        const OUTPUT: u32 = 1;
        const ALTERNATE: u32 = 2;
        let is_driven = |number| matches!(self.ports[port].mode(number), OUTPUT | ALTERNATE);
        let mut tied = self.wiring.tied.iter().filter(|pin| pin.port == port);
        match tied.find(|pin| is_driven(pin.number)) {
            None => Ok(()),
            Some(pin) => {
                Err(format!("{} is driven, and the board connects it to a supply", pin.name()))
            }
        }
    }
}
