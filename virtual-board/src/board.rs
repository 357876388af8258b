//! The board: an ELF, its chip and its sensor, and the lines that lead out.

use std::collections::BTreeMap;

use lsm6dsox::sim::{
    Fault as SensorFault, Motion, Part as Sensor, PartOptions, StartTimes, Stimulus,
};

use crate::chip::{Chip, ChipOptions, NOMINAL_MV, Transaction};
use crate::core::cpu::{Cpu, State};
use crate::core::nvic::exception;
use crate::corner::Corner;
use crate::elf::{ElfError, Image};
use crate::failure::Failure;
use crate::machine::{Counters, FaultNote, Machine};
use crate::memory::UNTOUCHED;
use crate::part::can::{BusFault, Frame, TimedFrame};
use crate::part::rcc::ResetCause;
use crate::part::usart::{LineFault, TimedByte};
use crate::time::from_us;

/// Which serial line leads out: USART1.
const CONSOLE: usize = 0;

/// The load sensor's channel: PC0.
const LOAD: usize = 10;

/// A branch to itself.
const ENDLESS_LOOP: u16 = 0xE7FE;

/// How a board is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardOptions {
    /// The chip.
    pub chip: ChipOptions,
    /// The specimen of the sensor; `None` where its bus is empty.
    pub sensor: Option<PartOptions>,
    /// What the load sensor's voltage converts to.
    pub load: u16,
    /// What TIM2 counts from when it is first started: as if it had run for so long already.
    pub time_base: u32,
}

impl Default for BoardOptions {
    fn default() -> Self {
        Self {
            chip: ChipOptions::default(),
            sensor: Some(PartOptions::default()),
            load: 0,
            time_base: 0,
        }
    }
}

impl BoardOptions {
    /// Takes chip and sensor from a corner: the sensor starts as fast or as slowly as parts do, and
    /// its data line is valid 10, 25 or 50 ns after the clock's edge.
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

/// A sensor that lies still, z up.
struct Still;

impl Motion for Still {
    fn at(&mut self, _: f64) -> Stimulus {
        Stimulus::REST
    }
}

/// What can go wrong with the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Of the sensor or its line.
    Sensor(SensorFault),
    /// The clock on the sensor's bus stops, and a reset of its controller does not mend it.
    SensorClockStopped,
    /// This stream of DMA2 meets an error in the middle of each transfer.
    DmaError(usize),
    /// Of the CAN bus.
    Bus(BusFault),
    /// Of the serial line.
    Line(LineFault),
    /// The crystal stops, and will not start again.
    CrystalLost,
    /// The supply dips.
    BrownOut,
    /// The supply becomes this, mV. Below what the option bytes say it is a dip, and comes back.
    Supply(u32),
    /// A debugger halts the core for so many ms.
    DebuggerHalt(u32),
    /// Somebody presses reset.
    Reset,
    /// The supply fails in this many operations of flash from now.
    CutInFlash(u64),
    /// In this many operations of flash from now, one that programs clears a bit too many.
    WornFlash(u64),
    /// The load sensor's voltage becomes this.
    Load(u16),
    /// The core jumps to where nothing is.
    Derail,
    /// The core hangs in an endless loop with interrupts masked.
    Hang,
    /// The core jumps to the panic handler.
    Panic,
    /// The stack pointer comes to the stack's end.
    StackOverflow,
    /// An interrupt of this number is no longer enabled, as by a flipped bit: whoever waits for it
    /// waits until the next reset.
    Deaf(u16),
    /// The pages with the settings are blank.
    SettingsErased,
    /// The pages with the settings hold anything: this seed says what.
    SettingsGarbage(u64),
    /// Bits have flipped all over the pages with the settings, where something was written.
    SettingsDamaged,
    /// Every fault of the sensor and its bus, of DMA, of CAN, of the serial line and of the load
    /// sensor goes.
    Clear,
}

/// A board that runs an ELF.
pub struct Board {
    cpu: Cpu,
    image: Image,
    /// What the load sensor's voltage converts to while all is well.
    load: u16,
}

impl Board {
    /// A board with an ELF in its flash, and its sensor at rest.
    ///
    /// # Errors
    /// Where the ELF is none, or does not fit.
    pub fn from_elf(elf: &[u8]) -> Result<Self, ElfError> {
        Self::with_motion(elf, BoardOptions::default(), Still)
    }

    /// A particular board, whose sensor feels `motion`.
    ///
    /// # Errors
    /// Where the ELF is none, or does not fit.
    pub fn with_motion(
        elf: &[u8],
        options: BoardOptions,
        motion: impl Motion + 'static,
    ) -> Result<Self, ElfError> {
        let image = Image::parse(elf)?;
        let sensor = options
            .sensor
            .map(|options| Sensor::with_options(motion, options));
        let mut chip = Chip::new(options.chip, sensor);
        chip.adc.inputs[LOAD] = options.load;
        chip.set_time_base(options.time_base);
        let cpu = Cpu::new(Machine::new(chip), &image.segments).map_err(ElfError)?;
        Ok(Self {
            cpu,
            image,
            load: options.load,
        })
    }

    /// Virtual time since power-up, in units of [`time`](crate::time).
    #[must_use]
    pub fn now(&self) -> u64 {
        self.cpu.machine().now
    }

    /// Runs for so long.
    ///
    /// # Errors
    /// Where the firmware did what is not modelled or what the part would not do as asked.
    pub fn run_for(&mut self, duration: u64) -> Result<(), Failure> {
        let until = self.now() + duration;
        self.run_until(until)
    }

    /// Runs until a time since power-up.
    ///
    /// # Errors
    /// As [`run_for`](Self::run_for).
    pub fn run_until(&mut self, until: u64) -> Result<(), Failure> {
        self.cpu
            .run_until(until)
            .map_err(|failure| self.named(failure))
    }

    fn named(&self, failure: Failure) -> Failure {
        match self.image.function_at(failure.pc) {
            Some(name) => Failure {
                what: format!("{} (in {name})", failure.what),
                ..failure
            },
            None => failure,
        }
    }

    /// The bytes that the serial line has sent since they were last taken.
    pub fn take_uart(&mut self) -> Vec<TimedByte> {
        core::mem::take(&mut self.cpu.machine().chip.usarts[CONSOLE].sent)
    }

    /// The frames that the board has sent over CAN since they were last taken.
    pub fn take_can(&mut self) -> Vec<TimedFrame> {
        core::mem::take(&mut self.cpu.machine().chip.can.sent)
    }

    /// How many frames from the bus came while the controller had no room for them.
    pub fn can_overruns(&mut self) -> u64 {
        self.cpu.machine().chip.can.overruns
    }

    /// Puts of frames into mailboxes since they were last taken: when, and which identifier.
    pub fn take_can_requests(&mut self) -> Vec<(u64, u32)> {
        core::mem::take(&mut self.cpu.machine().chip.can.requested)
    }

    /// Keeps what goes over the sensor's bus from now on, if not for long already.
    pub fn record_sensor_bus(&mut self) {
        let transactions = &mut self.cpu.machine().chip.transactions;
        transactions.get_or_insert_default();
    }

    /// What has gone over the sensor's bus since it was last taken, without what still goes on.
    pub fn take_transactions(&mut self) -> Vec<Transaction> {
        let mut machine = self.cpu.machine();
        let Some(all) = &mut machine.chip.transactions else {
            return Vec::new();
        };
        let last = all.len().saturating_sub(1);
        let current = all.split_off(last);
        core::mem::replace(all, current)
    }

    /// Sends bytes to the board over the serial line, from now on, at its rate.
    pub fn push_uart(&mut self, bytes: &[u8]) {
        let mut machine = self.cpu.machine();
        let now = machine.now;
        let pclk = machine.chip.usart_clock(CONSOLE);
        machine.chip.usarts[CONSOLE].push(bytes, now, pclk);
        machine.wake();
    }

    /// Sends a frame to the board over CAN, as soon as the bus is free.
    pub fn push_can(&mut self, frame: Frame) {
        let mut machine = self.cpu.machine();
        let now = machine.now;
        machine.chip.can.push(frame, now);
        machine.wake();
    }

    /// Lets something go wrong now.
    pub fn inject(&mut self, fault: Fault) {
        match fault {
            Fault::Derail => return self.cpu.derail(0x6000_0000, false),
            Fault::Hang => {
                // At the far end of the stack, which nobody uses while all is well.
                let start = 0x2000_0000;
                self.cpu.memory().write(start, &ENDLESS_LOOP.to_le_bytes());
                return self.cpu.derail(start, true);
            }
            Fault::Panic => return self.derail_to("rust_begin_unwind"),
            Fault::StackOverflow => {
                let end = self.image.symbol("_stack_end").unwrap_or(0x2000_0000);
                return self.cpu.move_stack(end);
            }
            Fault::SettingsErased => return self.spoil_settings(|_, _| 0xFF),
            Fault::SettingsGarbage(seed) => return self.fill_settings(seed),
            Fault::SettingsDamaged => {
                return self.spoil_settings(|place, byte| {
                    let hit = place % 37 == 9 && byte != 0xFF;
                    byte ^ u8::from(hit) << 2
                });
            }
            _ => {}
        }
        let mut machine = self.cpu.machine();
        let now = machine.now;
        match fault {
            Fault::Sensor(fault) => {
                machine.chip.with_sensor(now, |sensor| sensor.inject(fault));
            }
            Fault::SensorClockStopped => machine.chip.set_sensor_clock_stopped(true, now),
            Fault::DmaError(stream) => machine.chip.failing_streams[stream & 7] = true,
            Fault::Bus(fault) => machine.chip.can.set_fault(fault),
            Fault::CrystalLost => machine.lose_crystal(),
            Fault::Supply(mv) => machine.chip.set_supply(mv),
            Fault::DebuggerHalt(ms) => machine.halt(from_us(u64::from(ms) * 1000)),
            Fault::BrownOut => machine.chip.request_reset(ResetCause::BrownOut),
            Fault::Reset => machine.chip.request_reset(ResetCause::Pin),
            Fault::CutInFlash(operations) => {
                let done = machine.chip.flash.operations;
                machine.chip.flash.cut_at = Some(done + operations);
            }
            Fault::WornFlash(operations) => {
                let done = machine.chip.flash.operations;
                machine.chip.flash.worn_at = Some(done + operations);
            }
            Fault::Load(code) => machine.chip.adc.inputs[LOAD] = code,
            Fault::Line(fault) => {
                let pclk = machine.chip.usart_clock(CONSOLE);
                machine.chip.usarts[CONSOLE].set_fault(fault, now, pclk);
            }
            Fault::Deaf(interrupt) => machine.nvic.disable(exception::INTERRUPT + interrupt),
            Fault::Derail
            | Fault::Hang
            | Fault::Panic
            | Fault::StackOverflow
            | Fault::SettingsErased
            | Fault::SettingsGarbage(_)
            | Fault::SettingsDamaged => {}
            Fault::Clear => {
                let pclk = machine.chip.usart_clock(CONSOLE);
                machine.chip.usarts[CONSOLE].set_fault(LineFault::None, now, pclk);
                machine.chip.with_sensor(now, Sensor::clear_faults);
                machine.chip.set_sensor_clock_stopped(false, now);
                machine.chip.failing_streams = [false; 8];
                machine.chip.can.set_fault(BusFault::None);
                machine.chip.adc.inputs[LOAD] = self.load;
                machine.chip.set_supply(NOMINAL_MV);
            }
        }
        machine.wake();
    }

    /// The core goes on in a function.
    fn derail_to(&mut self, name: &str) {
        let functions = &self.image.functions;
        let function = functions.iter().find(|(.., known)| known.contains(name));
        if let Some(&(start, ..)) = function {
            self.cpu.derail(start, false);
        }
    }

    /// Fills the pages with the settings with what `seed` says: some of them with noise, some with
    /// noise in a blank page, and the rest with bits that are cleared all over.
    fn fill_settings(&mut self, seed: u64) {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let kind = next() % 3;
        let (from, length) = (next() as usize % 0x8000, next() as usize % 0x1000);
        let noise: Vec<u8> = (0..0x8000).map(|_| (next() >> 32) as u8).collect();
        let sparse: Vec<bool> = (0..0x8000).map(|_| next() % 64 == 0).collect();
        self.spoil_settings(|place, byte| {
            let noise = noise.get(place).copied().unwrap_or(0);
            let is_sparse = sparse.get(place).copied().unwrap_or(false);
            match kind {
                0 => noise,
                1 if (from..from + length).contains(&place) => noise,
                1 => 0xFF,
                _ if is_sparse => byte & noise,
                _ => byte,
            }
        });
    }

    /// Where the pages with the settings begin and end.
    fn settings_pages(&self) -> Option<(u32, u32)> {
        let ends = ["_config_start", "_config_end"].map(|name| self.image.symbol(name));
        let [Some(start), Some(end)] = ends else {
            return None;
        };
        Some((start, end))
    }

    /// The pages with the settings; empty where the ELF has none.
    pub fn settings(&mut self) -> Vec<u8> {
        let pages = self.settings_pages();
        let bytes =
            pages.and_then(|(start, end)| self.memory(start, end.saturating_sub(start) as usize));
        bytes.unwrap_or_default()
    }

    /// Puts bytes into the pages with the settings, from their beginning.
    pub fn set_settings(&mut self, bytes: &[u8]) {
        if let Some((start, _)) = self.settings_pages() {
            self.cpu.memory().write(start, bytes);
        }
    }

    /// Changes the pages with the settings, byte by byte.
    fn spoil_settings(&mut self, change: impl Fn(usize, u8) -> u8) {
        let mut bytes = self.settings();
        for (place, byte) in bytes.iter_mut().enumerate() {
            *byte = change(place, *byte);
        }
        self.set_settings(&bytes);
    }

    /// Instructions, cycles and time so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.cpu.machine().counters()
    }

    /// What the core does.
    #[must_use]
    pub const fn state(&self) -> State {
        self.cpu.state()
    }

    /// Faults of the architecture that the program saw.
    #[must_use]
    pub fn faults(&self) -> Vec<FaultNote> {
        self.cpu.machine().faults.clone()
    }

    /// Resets since power-up: when and why.
    #[must_use]
    pub fn resets(&self) -> Vec<(u64, ResetCause)> {
        self.cpu.machine().chip.resets.clone()
    }

    /// How often each exception was taken.
    #[must_use]
    pub fn exceptions(&self) -> Vec<(u16, u64)> {
        let machine = self.cpu.machine();
        machine
            .exceptions
            .iter()
            .map(|(&number, &count)| (number, count))
            .collect()
    }

    /// Counts the instructions of a function apart, from now on, with all that it calls and what
    /// interrupts it; of the first function whose name contains `part`. False where there is none.
    pub fn watch_function(&mut self, part: &str) -> bool {
        let mut functions = self.image.functions.iter();
        let found = functions.find(|(_, _, name)| name.contains(part));
        if let Some((address, _, _)) = found {
            self.cpu.machine().watch(*address);
        }
        found.is_some()
    }

    /// Instructions of the functions watched, of calls that have returned. Of one that another calls
    /// they count twice.
    #[must_use]
    pub fn watched_instructions(&self) -> u64 {
        let machine = self.cpu.machine();
        let instructions = machine.watched.iter().map(|watched| watched.instructions);
        instructions.sum()
    }

    /// Counts instructions by function from now on.
    pub fn start_profile(&mut self) {
        self.cpu.machine().start_profile();
    }

    /// Instructions by function since the profile was started, and cycles of waiting for flash;
    /// most instructions first.
    #[must_use]
    pub fn profile(&self) -> Vec<(String, [u64; 2])> {
        let machine = self.cpu.machine();
        let mut functions = BTreeMap::<&str, [u64; 2]>::new();
        let counts = machine.profile.iter().zip(&machine.wait_profile);
        for (place, (&instructions, &waits)) in counts.enumerate() {
            if instructions > 0 {
                let address = 0x0800_0000 + 2 * place as u32;
                let name = self.image.function_at(address).unwrap_or("?");
                let sums = functions.entry(name).or_default();
                sums[0] += instructions;
                sums[1] += waits;
            }
        }
        let mut functions: Vec<_> = functions
            .into_iter()
            .map(|(name, count)| (name.to_owned(), count))
            .collect();
        functions.sort_by_key(|(name, count)| (core::cmp::Reverse(*count), name.clone()));
        functions
    }

    /// A core register: R0 to R12, SP, LR, PC.
    #[must_use]
    pub fn register(&self, index: usize) -> u32 {
        self.cpu.register(index)
    }

    /// The function that executes.
    #[must_use]
    pub fn function(&self) -> Option<&str> {
        self.image.function_at(self.register(15))
    }

    /// The ELF.
    #[must_use]
    pub const fn image(&self) -> &Image {
        &self.image
    }

    /// Bytes of memory, as a debugger reads them; `None` where there is no memory.
    pub fn memory(&mut self, address: u32, length: usize) -> Option<Vec<u8>> {
        let mut bytes = vec![0; length];
        self.cpu.memory().read(address, &mut bytes).then_some(bytes)
    }

    /// The core with everything around it, for what has no method here.
    pub const fn cpu(&mut self) -> &mut Cpu {
        &mut self.cpu
    }

    /// The deepest that the stack between two addresses has been, bytes from its upper end; what
    /// was never written holds [`UNTOUCHED`] or the start-up code's own paint.
    pub fn stack_high_water(&mut self, low: u32, high: u32) -> usize {
        const PAINT: [u8; 4] = 0xCCCC_CCCC_u32.to_le_bytes();
        let Some(bytes) = self.memory(low, high.saturating_sub(low) as usize) else {
            return 0;
        };
        let untouched = bytes
            .chunks_exact(4)
            .take_while(|word| *word == PAINT || word.iter().all(|&byte| byte == UNTOUCHED))
            .count();
        bytes.len() - 4 * untouched
    }
}
