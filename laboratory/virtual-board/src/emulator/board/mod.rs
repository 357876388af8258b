//! The board: an ELF, its chip, its sensor and its external lines.

mod injection;
mod observe;

use lsm6dsox::sim::{Motion, Part as Sensor, PartOptions, StartTimes, Stimulus};

use crate::emulator::chip::{Chip, ChipOptions, Transaction};
use crate::emulator::core::cpu::Cpu;
use crate::emulator::corner::Corner;
use crate::emulator::elf::{ElfError, ElfImage};
use crate::emulator::failure::Failure;
use crate::emulator::machine::Machine;
use crate::emulator::memory::{OPTIONS, UNIQUE_NUMBER};
use crate::emulator::part::can::{BusFrame, TimedFrame};
use crate::emulator::part::usart::TimedByte;
use crate::emulator::wiring::Wiring;
pub use injection::Injection;

/// Options of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardOptions {
    /// The board; `None` is the one for which the ELF is built.
    pub wiring: Option<&'static Wiring>,
    /// The chip.
    pub chip: ChipOptions,
    /// Specimen of the sensor; `None` if its bus is empty.
    pub sensor: Option<PartOptions>,
    /// Code of the load sensor's voltage.
    pub load: u16,
    /// Count of TIM2 when it is first started, as if it had already run that long.
    pub time_base: u32,
}

impl Default for BoardOptions {
    fn default() -> Self {
        Self {
            wiring: None,
            chip: ChipOptions::default(),
            sensor: Some(PartOptions::default()),
            load: 0,
            time_base: 0,
        }
    }
}

impl BoardOptions {
    /// Applies a corner to chip and sensor: the sensor starts at the fast or slow end of its range, and its data
    /// line is valid 10, 25 or 50 ns after the clock's edge.
    pub const fn set_corner(&mut self, corner: Corner) {
        self.chip.corner = corner;
        if let Some(sensor) = &mut self.sensor {
            (sensor.start, sensor.sdo_delay_ns) = match corner {
                Corner::Fast => (StartTimes::FASTEST, 10),
                Corner::Typical => (StartTimes::SLOWEST, 25),
                Corner::Slow => (StartTimes::SLOWEST, 50),
            };
        }
    }
}

/// A board that runs an ELF.
pub struct Board {
    cpu: Cpu,
    /// The ELF.
    pub image: ElfImage,
    wiring: &'static Wiring,
    /// Code of the load sensor's voltage without a fault.
    load: u16,
}

impl Board {
    /// Creates a board with an ELF in flash and the sensor at rest.
    ///
    /// # Errors
    /// If the ELF is invalid or does not fit.
    pub fn from_elf(elf: &[u8]) -> Result<Self, ElfError> {
        Self::with_motion(elf, BoardOptions::default(), |_: f64| Stimulus::REST)
    }

    /// Creates a board with `options`, whose sensor feels `motion`.
    ///
    /// # Errors
    /// If the ELF is invalid or does not fit.
    pub fn with_motion(
        elf: &[u8],
        options: BoardOptions,
        motion: impl Motion + 'static,
    ) -> Result<Self, ElfError> {
        Self::with_bootloader(None, elf, options, motion)
    }

    /// Creates a board whose bootloader starts the ELF; without one, the ELF starts at once.
    ///
    /// # Errors
    /// If an ELF is invalid or does not fit.
    pub fn with_bootloader(
        bootloader: Option<&[u8]>,
        elf: &[u8],
        options: BoardOptions,
        motion: impl Motion + 'static,
    ) -> Result<Self, ElfError> {
        let image = ElfImage::parse(elf)?;
        let mut segments = image.segments.clone();
        let mut vectors = image.vectors();
        if let Some(elf) = bootloader {
            let bootloader = ElfImage::parse(elf)?;
            vectors = bootloader.vectors();
            segments.extend(bootloader.segments);
        }
        let sensor = options.sensor.map(|options| Sensor::with_options(motion, options));
        let wiring = options.wiring.unwrap_or_else(|| Wiring::of(&image));
        let mut chip = Chip::new(options.chip, wiring, sensor);
        chip.adc.inputs[wiring.load.1] = options.load;
        chip.timers[0].head_start = options.time_base;
        let options_in_memory = chip.flash.option_bytes();
        let mut cpu = Cpu::new(Machine::new(chip), &segments, vectors).map_err(ElfError)?;
        cpu.memory().write(OPTIONS.start, &options_in_memory);
        Ok(Self { cpu, image, wiring, load: options.load })
    }

    /// Virtual time since power-up, in units of [`time`](crate::emulator::time).
    #[must_use]
    pub fn now(&self) -> u64 {
        self.cpu.machine().now
    }

    /// Runs for a duration, in units of [`time`](crate::emulator::time).
    ///
    /// # Errors
    /// If the firmware misused the part or used something that is not modelled.
    pub fn run_for(&mut self, duration: u64) -> Result<(), Failure> {
        let until = self.now() + duration;
        self.run_until(until)
    }

    /// Runs until a time since power-up.
    ///
    /// # Errors
    /// As [`run_for`](Self::run_for).
    pub fn run_until(&mut self, until: u64) -> Result<(), Failure> {
        self.cpu.run_until(until).map_err(|failure| self.named(failure))
    }

    fn named(&self, failure: Failure) -> Failure {
        match self.image.function_at(failure.pc) {
            Some(name) => Failure { what: format!("{} (in {name})", failure.what), ..failure },
            None => failure,
        }
    }

    /// Takes the bytes sent over the serial line since the last call.
    pub fn take_uart(&mut self) -> Vec<TimedByte> {
        core::mem::take(&mut self.cpu.machine().chip.usarts[self.wiring.usart].sent)
    }

    /// Takes the frames sent over CAN since the last call.
    pub fn take_can(&mut self) -> Vec<TimedFrame> {
        core::mem::take(&mut self.cpu.machine().chip.can.sent)
    }

    /// Takes the writes of frames to mailboxes since the last call: time and identifier.
    pub fn take_can_requests(&mut self) -> Vec<(u64, u32)> {
        core::mem::take(&mut self.cpu.machine().chip.can.requested)
    }

    /// Records the sensor's bus from now on, unless it is already recorded.
    pub fn record_sensor_bus(&mut self) {
        let transactions = &mut self.cpu.machine().chip.transactions;
        transactions.get_or_insert_default();
    }

    /// Takes the completed transactions on the sensor's bus since the last call.
    pub fn take_transactions(&mut self) -> Vec<Transaction> {
        let mut machine = self.cpu.machine();
        let open = usize::from(machine.chip.selected);
        let Some(all) = &mut machine.chip.transactions else {
            return Vec::new();
        };
        let current = all.split_off(all.len().saturating_sub(open));
        core::mem::replace(all, current)
    }

    /// Sends bytes to the board over the serial line, starting now, at its rate.
    pub fn push_uart(&mut self, bytes: &[u8]) {
        let mut machine = self.cpu.machine();
        let now = machine.now;
        let pclk = machine.chip.usart_clock(self.wiring.usart);
        machine.chip.usarts[self.wiring.usart].push(bytes, now, pclk);
        machine.wake();
    }

    /// Sends a frame to the board over CAN, as soon as the bus is free.
    pub fn push_can(&mut self, frame: BusFrame) {
        self.push_can_at(frame, self.now());
    }

    /// Sends a frame to the board over CAN, starting no earlier than `time`. Times must not decrease.
    pub fn push_can_at(&mut self, frame: BusFrame, time: u64) {
        let mut machine = self.cpu.machine();
        machine.chip.can.push(frame, time);
        machine.wake();
    }

    /// Discards frames for the board that should have begun before `time`, as when it is off the bus.
    pub fn withdraw_can(&mut self, time: u64) {
        self.cpu.machine().chip.can.withdraw(time);
    }

    /// Clock of the processor, Hz.
    #[must_use]
    pub fn processor_hertz(&self) -> u32 {
        self.cpu.machine().chip.rcc.clocks.hclk
    }

    /// Bit rate of the CAN controller, bit/s; `None` while it does not take part in bus traffic.
    #[must_use]
    pub fn can_bit_rate(&self) -> Option<u32> {
        let machine = self.cpu.machine();
        let can = &machine.chip.can;
        can.takes_part().then(|| can.bit_rate())
    }

    /// Number of bytes on their way to the board over the serial line.
    #[must_use]
    pub fn uart_incoming(&self) -> usize {
        self.cpu.machine().chip.usarts[self.wiring.usart].incoming()
    }

    /// Sets the first word of the chip's unique number, which differs between boards. Call before the first run.
    pub fn set_serial_number(&mut self, number: u32) {
        let memory = self.cpu.memory();
        memory.write(UNIQUE_NUMBER, &number.to_le_bytes());
    }

    /// Start and end address of the settings pages.
    fn settings_pages(&self) -> Option<(u32, u32)> {
        let start = self.image.symbol("_config_start")?;
        Some((start, self.image.symbol("_config_end")?))
    }

    /// Content of the settings pages; empty if the ELF has none.
    pub fn settings(&mut self) -> Vec<u8> {
        let pages = self.settings_pages();
        let bytes =
            pages.and_then(|(start, end)| self.memory(start, end.saturating_sub(start) as usize));
        bytes.unwrap_or_default()
    }

    /// Writes bytes to the settings pages, from their beginning.
    pub fn set_settings(&mut self, bytes: &[u8]) {
        if let Some((start, _)) = self.settings_pages() {
            self.cpu.memory().write(start, bytes);
        }
    }

    /// The core with its surroundings, for access that has no method here.
    pub const fn cpu(&mut self) -> &mut Cpu {
        &mut self.cpu
    }
}
