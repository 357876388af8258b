//! The chip around the core: which peripheral is where, what it hangs on, and what moves between
//! them: interrupts, DMA, the sensor on its bus.

mod places;
mod requests;

use lsm6dsox::setting::Pin;
use lsm6dsox::sim::Part as Sensor;

use crate::core::dbgmcu::Dbgmcu;
use crate::core::nvic::Nvic;
use crate::corner::Corner;
use crate::memory::Memory;
use crate::part::adc::Adc;
use crate::part::can::Can;
use crate::part::dma::Dma;
use crate::part::exti::{Exti, LINES};
use crate::part::flash::Flash;
use crate::part::gpio::Gpio;
use crate::part::iwdg::Iwdg;
use crate::part::pwr::Pwr;
use crate::part::rcc::{Rcc, ResetCause};
use crate::part::spi::Spi;
use crate::part::timer::Timer;
use crate::part::usart::Usart;
use crate::time::{self, NEVER, cycle, from_ns, to_ns};
use places::{PLACES, Part};
use requests::{Request, request};

/// What a peripheral may need to act.
pub struct Context<'a> {
    /// Virtual time.
    pub now: u64,
    /// Memory, for DMA and flash.
    pub memory: &'a mut dyn Memory,
}

/// The supply while all is well, mV.
pub const NOMINAL_MV: u32 = 3_300;

const TIMER_INTERRUPTS: [u16; 4] = [28, 29, 30, 50];
/// Which of these timers each of them has as its internal triggers 0 to 3; the others are not
/// modelled (RM0090, table 98).
const TRIGGERS: [[Option<usize>; 4]; 4] = [
    [None, None, Some(1), Some(2)],
    [None, Some(0), Some(3), Some(2)],
    [None, Some(0), Some(1), None],
    [Some(0), Some(1), Some(2), None],
];

const SPI_INTERRUPTS: [u16; 3] = [35, 36, 51];
const USART_INTERRUPTS: [u16; 4] = [37, 38, 39, 71];
const CAN_INTERRUPTS: [u16; 4] = [19, 20, 21, 22];
const DMA_INTERRUPTS: [[u16; 8]; 2] = [
    [11, 12, 13, 14, 15, 16, 17, 47],
    [56, 57, 58, 59, 60, 68, 69, 70],
];

/// What the chip is made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChipOptions {
    /// The crystal, hertz; `None` where it does not start.
    pub crystal: Option<u32>,
    /// Which specimen of what the data sheet allows.
    pub corner: Corner,
}

impl Default for ChipOptions {
    /// 8 MHz, and a typical chip.
    fn default() -> Self {
        Self {
            crystal: Some(8_000_000),
            corner: Corner::default(),
        }
    }
}

/// What went over the sensor's bus while its chip select was low.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transaction {
    /// When the chip select fell, in units of [`time`].
    pub start: u64,
    /// When the last byte was through.
    pub end: u64,
    /// When the sensor's pin had last risen before.
    pub edge: Option<u64>,
    /// To the sensor.
    pub out: Vec<u8>,
    /// From it.
    pub back: Vec<u8>,
}

/// The chip's peripherals and what is soldered to it.
pub struct Chip {
    /// Reset and clocks.
    pub rcc: Rcc,
    /// The flash interface.
    pub flash: Flash,
    /// The CAN controller with its bus.
    pub can: Can,
    /// USART1, 2, 3 and 6 with their lines.
    pub usarts: [Usart; 4],
    /// The converter with its inputs.
    pub adc: Adc,
    /// Ports A to I.
    pub ports: [Gpio; 9],
    /// The sensor on SPI1: CS on PA4, INT1 on PA0.
    pub sensor: Option<Sensor>,
    /// When the sensor's pin last rose.
    pub data_ready: Option<u64>,
    /// Transactions with the sensor, where they are kept.
    pub transactions: Option<Vec<Transaction>>,
    /// How often the chip was reset, and why last.
    pub resets: Vec<(u64, ResetCause)>,
    /// Streams of DMA2 that meet an error in the middle of each transfer.
    pub failing_streams: [bool; 8],
    pwr: Pwr,
    exti: Exti,
    dmas: [Dma; 2],
    spis: [Spi; 3],
    timers: [Timer; 4],
    iwdg: Iwdg,
    selected: bool,
    pin_high: bool,
    sensor_edge: u64,
    reset_cause: Option<ResetCause>,
    power_lost: bool,
}

impl Default for Chip {
    fn default() -> Self {
        Self::new(ChipOptions::default(), None)
    }
}

impl Chip {
    /// A chip just powered up.
    #[must_use]
    pub fn new(options: ChipOptions, sensor: Option<Sensor>) -> Self {
        let rcc = Rcc::new(options.crystal, options.corner);
        let clocks = rcc.clocks();
        let period = cycle(clocks.timers1);
        let mut ports: [Gpio; 9] = core::array::from_fn(Gpio::new);
        ports[0].driven = u16::from(sensor.is_some());
        Self {
            can: Can::new(clocks.pclk1),
            rcc,
            flash: Flash::new(options.corner),
            usarts: Default::default(),
            adc: Adc::default(),
            ports,
            sensor,
            data_ready: None,
            transactions: None,
            resets: Vec::new(),
            failing_streams: [false; 8],
            pwr: Pwr::default(),
            exti: Exti::default(),
            dmas: Default::default(),
            spis: Default::default(),
            timers: [
                Timer::new("TIM2", 32, period),
                Timer::new("TIM3", 16, period),
                Timer::new("TIM4", 16, period),
                Timer::new("TIM5", 32, period),
            ],
            iwdg: Iwdg::new(options.corner.lsi_hz()),
            selected: false,
            pin_high: false,
            sensor_edge: NEVER,
            reset_cause: None,
            power_lost: false,
        }
    }

    /// What TIM2 counts from when it is first started.
    pub const fn set_time_base(&mut self, count: u32) {
        self.timers[0].head_start = count;
    }

    /// The cycle of the core's clock.
    #[must_use]
    pub const fn period(&self) -> u64 {
        cycle(self.rcc.clocks().hclk)
    }

    /// A reset, for whatever reason was noted.
    pub fn reset(&mut self, now: u64) {
        let cause = self.reset_cause.take().unwrap_or(ResetCause::Pin);
        self.resets.push((now, cause));
        self.rcc.reset(cause);
        self.flash.reset();
        let clocks = self.rcc.clocks();
        self.can.reset(clocks.pclk1, now);
        for usart in &mut self.usarts {
            usart.reset();
        }
        self.adc.reset();
        for port in &mut self.ports {
            port.reset();
        }
        self.pwr = Pwr::default();
        self.exti = Exti::default();
        self.dmas = Default::default();
        for spi in &mut self.spis {
            spi.reset();
        }
        for timer in &mut self.timers {
            timer.reset(cycle(clocks.timers1));
        }
        self.iwdg.reset();
        self.update_select(now);
    }

    /// The program asked for a reset.
    pub(crate) const fn note_software_reset(&mut self) {
        self.reset_cause = Some(ResetCause::Software);
    }

    /// Resets the chip from outside. A dip of the supply takes the sensor and memory with it.
    pub fn request_reset(&mut self, cause: ResetCause) {
        self.reset_cause = Some(cause);
        if matches!(cause, ResetCause::BrownOut | ResetCause::PowerOn) {
            self.power_lost = true;
            if let Some(sensor) = &mut self.sensor {
                sensor.inject(lsm6dsox::sim::Fault::Reset);
            }
        }
    }

    /// The supply becomes this, mV: below what the option bytes say the chip is reset, and the
    /// supply then comes back.
    pub fn set_supply(&mut self, mv: u32) {
        self.flash.supply_mv = mv;
        if mv < self.flash.brown_out_mv() {
            self.flash.supply_mv = NOMINAL_MV;
            self.request_reset(ResetCause::BrownOut);
        }
    }

    /// A debugger halts the core, or lets it go on: what its settings say stands still meanwhile.
    pub(crate) fn freeze(&mut self, frozen: bool, debug: &Dbgmcu, now: u64) {
        for (index, timer) in self.timers.iter_mut().enumerate() {
            timer.freeze(frozen && debug.freezes_timer(index), now);
        }
        self.iwdg.freeze(frozen && debug.freezes_watchdog(), now);
    }

    /// Whether memory has lost its content.
    pub(crate) const fn take_power_lost(&mut self) -> bool {
        core::mem::replace(&mut self.power_lost, false)
    }

    /// Whether a reset is due.
    pub(crate) fn take_reset_request(&mut self) -> bool {
        if core::mem::take(&mut self.flash.cut) {
            self.flash.cut_at = None;
            self.request_reset(ResetCause::PowerOn);
        }
        self.reset_cause.is_some()
    }

    pub(crate) const fn take_flash_changed(&mut self) -> Option<(u32, u32)> {
        self.flash.take_changed()
    }

    pub(crate) const fn take_stall(&mut self) -> u64 {
        self.flash.take_stall()
    }

    const fn pclk_of_spi(&self, index: usize) -> u32 {
        let clocks = self.rcc.clocks();
        if index == 0 {
            clocks.pclk2
        } else {
            clocks.pclk1
        }
    }

    const fn pclk_of_usart(&self, index: usize) -> u32 {
        let clocks = self.rcc.clocks();
        if index == 0 || index == 3 {
            clocks.pclk2
        } else {
            clocks.pclk1
        }
    }

    /// The clock on the sensor's bus stops, or runs again.
    pub const fn set_sensor_clock_stopped(&mut self, stopped: bool, now: u64) {
        let pclk = self.pclk_of_spi(0);
        self.spis[0].set_stopped(stopped, now, pclk);
    }

    /// The peripheral's clock of a serial line.
    #[must_use]
    pub const fn usart_clock(&self, index: usize) -> u32 {
        self.pclk_of_usart(index)
    }

    /// When something happens next.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        if self.rcc.is_stopped() {
            return self.iwdg.next_event();
        }
        let timers = self.timers.iter().map(Timer::next_event);
        let spis = self.spis.iter().map(Spi::next_event);
        let usarts = self.usarts.iter().map(Usart::next_event);
        let others = [
            self.can.next_event(),
            self.adc.next_event(),
            self.iwdg.next_event(),
            self.sensor_edge,
        ];
        timers
            .chain(spis)
            .chain(usarts)
            .chain(others)
            .min()
            .unwrap_or(NEVER)
    }

    /// Lets everything happen that is due.
    ///
    /// # Errors
    /// Where something is used that is not modelled.
    pub fn advance(&mut self, context: &mut Context) -> Result<(), String> {
        let now = context.now;
        loop {
            // One after the other in their order of time, as DMA may start the next.
            let due = self.next_event();
            let at = due.min(now);
            self.advance_parts(at)?;
            self.serve_dma(context.memory, at)?;
            if due > now {
                return Ok(());
            }
            if self.reset_cause.is_some() && self.next_event() == due {
                return Ok(());
            }
        }
    }

    fn advance_parts(&mut self, now: u64) -> Result<(), String> {
        if self.iwdg.next_event() <= now {
            self.iwdg.reset();
            self.reset_cause = Some(ResetCause::Watchdog);
        }
        if self.rcc.is_stopped() {
            return Ok(());
        }
        self.advance_sensor(now);
        for timer in &mut self.timers {
            if timer.next_event() <= now {
                timer.advance(now);
            }
        }
        for index in 0..self.spis.len() {
            let pclk = self.pclk_of_spi(index);
            if let Some(out) = self.spis[index].take_frame(now) {
                let answer = if index == 0 {
                    self.exchange(out, now)
                } else {
                    0xFF
                };
                self.spis[index].finish_frame(answer, now, pclk);
            }
        }
        for index in 0..self.usarts.len() {
            let pclk = self.pclk_of_usart(index);
            if self.usarts[index].next_event() <= now {
                self.usarts[index].advance(now, pclk);
            }
        }
        self.can.advance(now);
        self.adc.advance(now);
        Ok(())
    }

    fn exchange(&mut self, out: u8, now: u64) -> u8 {
        let Some(sensor) = &mut self.sensor else {
            // Nobody drives the line: what the pin is pulled to.
            return if self.ports[0].is_pulled_up(6) {
                0xFF
            } else {
                0
            };
        };
        sensor.advance_to(to_ns(now));
        if !self.selected {
            return if self.ports[0].is_pulled_up(6) {
                0xFF
            } else {
                0
            };
        }
        let answer = sensor.exchange(out);
        if let Some(transaction) = self.transactions.as_mut().and_then(|all| all.last_mut()) {
            transaction.end = now;
            transaction.out.push(out);
            transaction.back.push(answer);
        }
        self.watch_pin(now);
        answer
    }

    /// The sensor's time goes on, and every edge of its pin is seen.
    fn advance_sensor(&mut self, now: u64) {
        while self.sensor_edge <= now {
            let edge = self.sensor_edge;
            if let Some(sensor) = &mut self.sensor {
                let edge_ns = to_ns(edge);
                sensor.advance_to(edge_ns.saturating_sub(1));
                let low = !sensor.pin_is_high(Pin::Int1);
                if low && self.pin_high {
                    self.set_pin(false, edge);
                }
                if let Some(sensor) = &mut self.sensor {
                    sensor.advance_to(edge_ns);
                }
            }
            self.watch_pin(edge);
            if self.sensor_edge == edge {
                // Announced, and yet not come: it will be announced anew.
                self.sensor_edge = NEVER;
            }
        }
    }

    fn watch_pin(&mut self, now: u64) {
        let Some(sensor) = &self.sensor else {
            return;
        };
        let high = sensor.pin_is_high(Pin::Int1);
        self.sensor_edge = sensor.next_rising_edge_ns(Pin::Int1).map_or(NEVER, from_ns);
        if high != self.pin_high {
            self.set_pin(high, now);
        }
    }

    fn set_pin(&mut self, high: bool, now: u64) {
        self.pin_high = high;
        if high {
            self.data_ready = Some(now);
        }
        let port = &mut self.ports[0];
        port.levels = port.levels & !1 | u16::from(high);
        self.exti.edge(0, 0, high);
        // PA0 is channel 1 of TIM2 as its alternate function 1, of TIM5 as 2.
        if port.mode(0) == 2 {
            let captured = match port.function(0) {
                1 if self.timers[0].edge(0, high, now) => Some(0),
                2 if self.timers[3].edge(0, high, now) => Some(3),
                _ => None,
            };
            if let Some(master) = captured {
                self.pulse(master);
            }
        }
    }

    /// A timer's trigger output has a pulse.
    fn pulse(&mut self, master: usize) {
        for (timer, triggers) in self.timers.iter_mut().zip(TRIGGERS) {
            let input = timer.counts_trigger().map(|input| triggers[input as usize]);
            if input == Some(Some(master)) {
                timer.trigger();
            }
        }
    }

    /// Faults of the sensor come and go between accesses; afterwards its pin is looked at anew.
    pub fn with_sensor<T>(&mut self, now: u64, act: impl FnOnce(&mut Sensor) -> T) -> Option<T> {
        let sensor = self.sensor.as_mut()?;
        sensor.advance_to(to_ns(now));
        let result = act(sensor);
        self.watch_pin(now);
        Some(result)
    }

    fn update_select(&mut self, now: u64) {
        // An input floats, and the sensor's pull-up holds the line.
        let low = self.ports[0].mode(4) == 1 && !self.ports[0].level(4);
        if low == self.selected {
            return;
        }
        self.selected = low;
        if low && let Some(transactions) = &mut self.transactions {
            transactions.push(Transaction {
                start: now,
                edge: self.data_ready,
                ..Transaction::default()
            });
        }
        if let Some(sensor) = &mut self.sensor {
            sensor.advance_to(to_ns(now));
            if low {
                sensor.select();
            } else {
                sensor.deselect();
            }
            self.watch_pin(now);
        }
    }

    fn is_requested(&self, request: Request) -> bool {
        match request {
            Request::SpiReceive(index) => self.spis[index].has_byte(),
            Request::SpiTransmit(index) => self.spis[index].wants_byte(),
            Request::UsartReceive(index) => self.usarts[index].has_byte(),
            Request::UsartTransmit(index) => self.usarts[index].wants_byte(),
        }
    }

    /// Moves what DMA is asked to move.
    fn serve_dma(&mut self, memory: &mut dyn Memory, now: u64) -> Result<(), String> {
        loop {
            let mut moved = false;
            for controller in 0..2 {
                for stream in 0..8 {
                    let Some(channel) = self.dmas[controller].streams[stream].channel() else {
                        continue;
                    };
                    let Some(request) = request(controller, stream, channel) else {
                        return Err(format!(
                            "DMA{} stream {stream} has no model of channel {channel}",
                            controller + 1
                        ));
                    };
                    if self.is_requested(request) {
                        self.move_item(controller, stream, memory, now)?;
                        moved = true;
                    }
                }
            }
            if !moved {
                return Ok(());
            }
        }
    }

    fn move_item(
        &mut self,
        controller: usize,
        stream: usize,
        memory: &mut dyn Memory,
        now: u64,
    ) -> Result<(), String> {
        if controller == 1
            && self.failing_streams[stream]
            && self.dmas[controller].streams[stream].is_half_done()
        {
            self.dmas[controller].moved(stream, false);
            return Ok(());
        }
        let item = self.dmas[controller].streams[stream].item();
        let mut bytes = [0; 4];
        // CCM RAM hangs on the core only.
        let reachable = !(0x1000_0000..0x1001_0000).contains(&item.memory);
        let worked = if item.to_peripheral {
            let read = reachable
                && bytes
                    .get_mut(..item.size)
                    .is_some_and(|bytes| memory.read(item.memory, bytes));
            if read {
                self.write_part(
                    memory,
                    now,
                    item.peripheral,
                    item.size,
                    u32::from_le_bytes(bytes),
                )?;
            }
            read
        } else {
            let value = self.read_part(now, item.peripheral)?;
            bytes = value.to_le_bytes();
            reachable
                && bytes
                    .get(..item.size)
                    .is_some_and(|bytes| memory.write(item.memory, bytes))
        };
        self.dmas[controller].moved(stream, worked);
        if !worked {
            return Err(format!("DMA cannot reach {:#010x}", item.memory));
        }
        Ok(())
    }

    /// The levels of all interrupt lines.
    pub(crate) fn drive_lines(&self, nvic: &mut Nvic) {
        for (timer, line) in self.timers.iter().zip(TIMER_INTERRUPTS) {
            nvic.set_line(line, timer.asks());
        }
        for (spi, line) in self.spis.iter().zip(SPI_INTERRUPTS) {
            nvic.set_line(line, spi.interrupts());
        }
        for (usart, line) in self.usarts.iter().zip(USART_INTERRUPTS) {
            nvic.set_line(line, usart.interrupts());
        }
        for (level, line) in self.can.lines().into_iter().zip(CAN_INTERRUPTS) {
            nvic.set_line(line, level);
        }
        for (dma, lines) in self.dmas.iter().zip(DMA_INTERRUPTS) {
            for (stream, line) in lines.into_iter().enumerate() {
                nvic.set_line(line, dma.asks(stream));
            }
        }
        let asking = self.exti.asking();
        for (line, mask) in LINES {
            nvic.set_line(line, asking & mask != 0);
        }
        nvic.set_line(18, self.adc.interrupts());
        nvic.set_line(4, self.flash.interrupts());
    }

    fn locate(&self, address: u32) -> Result<(Part, u32), String> {
        let place = PLACES
            .iter()
            .find(|place| address >= place.base && address - place.base < place.size)
            .ok_or_else(|| "a peripheral that is not modelled".to_owned())?;
        if let Some((register, bit)) = place.enable
            && !self.rcc.is_enabled(register, bit)
        {
            return Err(format!("{} is not clocked", place.name));
        }
        Ok((place.part, address - place.base))
    }

    fn read_part(&mut self, now: u64, address: u32) -> Result<u32, String> {
        let (part, offset) = self.locate(address)?;
        let offset = offset & !3;
        match part {
            Part::Timer(index) => self.timers[index].read(offset, now),
            Part::Spi(index) => self.spis[index].read(offset),
            Part::Usart(index) => self.usarts[index].read(offset),
            Part::Can => self.can.read(offset, now),
            Part::Pwr => self.pwr.read(offset, self.flash.supply_mv),
            Part::Iwdg => self.iwdg.read(offset),
            Part::Adc => self.adc.read(offset, now),
            Part::Syscfg => self.exti.read_syscfg(offset),
            Part::Exti => self.exti.read(offset),
            Part::Gpio(0) => {
                if let Some(sensor) = &mut self.sensor {
                    sensor.advance_to(to_ns(now));
                }
                self.watch_pin(now);
                self.ports[0].read(offset)
            }
            Part::Gpio(index) => self.ports[index].read(offset),
            Part::Rcc => self.rcc.read(offset, now),
            Part::Flash => self.flash.read(offset),
            Part::Dma(index) => self.dmas[index].read(offset),
        }
    }

    fn write_part(
        &mut self,
        memory: &mut dyn Memory,
        now: u64,
        address: u32,
        size: usize,
        value: u32,
    ) -> Result<(), String> {
        let (part, offset) = self.locate(address)?;
        let (value, offset) = match (part, size) {
            (_, 4) => (value, offset),
            // What goes out is as wide as the store; other registers take words.
            (Part::Spi(_), 1 | 2) if offset == 0xC => (value & 0xFF, offset),
            (Part::Usart(_), 1 | 2) if offset == 4 => (value & 0x1FF, offset),
            (_, 2) if offset.is_multiple_of(4) => (value & 0xFFFF, offset),
            _ => return Err(format!("a store of {size} bytes to a register")),
        };
        match part {
            Part::Timer(index) => self.timers[index].write(offset, value, now),
            Part::Spi(index) => {
                let pclk = self.pclk_of_spi(index);
                self.spis[index].write(offset, value, now, pclk)?;
                self.check_sensor_bus(index, offset, pclk)
            }
            Part::Usart(index) => {
                let pclk = self.pclk_of_usart(index);
                self.usarts[index].write(offset, value, now, pclk)
            }
            Part::Can => self.can.write(offset, value, now),
            Part::Pwr => self.pwr.write(offset, value),
            Part::Iwdg => self.iwdg.write(offset, value, now),
            Part::Adc => {
                let pclk = self.rcc.clocks().pclk2;
                self.adc.write(offset, value, now, pclk)
            }
            Part::Syscfg => self.exti.write_syscfg(offset, value),
            Part::Exti => self.exti.write(offset, value),
            Part::Gpio(index) => {
                self.ports[index].write(offset, value)?;
                if index == 0 {
                    self.update_select(now);
                }
                Ok(())
            }
            Part::Rcc => self.write_rcc(offset, value, now),
            Part::Flash => {
                self.flash.reset_at = self.iwdg.next_event();
                self.flash.write(offset, value, now, memory)?;
                self.rcc.check_wait_states(self.flash.wait_states())
            }
            Part::Dma(index) => self.dmas[index].write(offset, value),
        }
    }

    /// The sensor takes bytes in modes 0 and 3 at no more than 10 MHz.
    fn check_sensor_bus(&mut self, index: usize, offset: u32, pclk: u32) -> Result<(), String> {
        if index != 0 || offset != 0xC || !self.selected {
            return Ok(());
        }
        let (rate, mode) = (self.spis[0].bit_rate(pclk), self.spis[0].mode());
        if rate > 10_000_000 {
            return Err(format!("the sensor's bus at {rate} Hz, above its 10 MHz"));
        }
        if mode == 1 || mode == 2 {
            return Err(format!("the sensor's bus in mode {mode}"));
        }
        if let Some(sensor) = &mut self.sensor {
            sensor.set_bus_clock(rate);
        }
        Ok(())
    }

    fn write_rcc(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        let before = self.rcc.clocks();
        self.rcc
            .write(offset, value, now, self.flash.wait_states())?;
        if self.rcc.clocks() != before {
            self.follow_clocks(now);
        }
        // Reset registers lie 0x20 below the enables.
        if matches!(offset, 0x10 | 0x20 | 0x24) {
            for place in &PLACES {
                if let Some((register, bit)) = place.enable
                    && register == offset + 0x20
                    && value & 1 << bit != 0
                {
                    self.reset_part(place.part, now);
                }
            }
        }
        Ok(())
    }

    fn follow_clocks(&mut self, now: u64) {
        let clocks = self.rcc.clocks();
        for timer in &mut self.timers {
            timer.set_period(now, cycle(clocks.timers1));
        }
        self.can.set_clock(clocks.pclk1);
    }

    /// The crystal stops: whether an NMI is due.
    ///
    /// # Errors
    /// As [`Rcc::lose_crystal`].
    pub(crate) fn lose_crystal(&mut self, now: u64) -> Result<bool, String> {
        let watched = self.rcc.lose_crystal(now, self.flash.wait_states())?;
        self.follow_clocks(now);
        Ok(watched)
    }

    fn reset_part(&mut self, part: Part, now: u64) {
        let clocks = self.rcc.clocks();
        match part {
            Part::Timer(index) => self.timers[index].reset(cycle(clocks.timers1)),
            Part::Spi(index) => self.spis[index].reset(),
            Part::Usart(index) => self.usarts[index].reset(),
            Part::Can => self.can.reset(clocks.pclk1, now),
            Part::Pwr => self.pwr = Pwr::default(),
            Part::Adc => self.adc.reset(),
            Part::Gpio(index) => {
                self.ports[index].reset();
                self.update_select(now);
            }
            Part::Dma(index) => self.dmas[index] = Dma::default(),
            Part::Syscfg | Part::Exti | Part::Iwdg | Part::Rcc | Part::Flash => {}
        }
    }

    /// A load by the core.
    ///
    /// # Errors
    /// Where what is there is not modelled or not clocked.
    pub fn read(
        &mut self,
        context: &mut Context,
        address: u32,
        size: usize,
    ) -> Result<u32, String> {
        let now = context.now;
        if let Some((word, bit)) = bit_band(address) {
            return Ok(self.read_part(now, word)? >> bit & 1);
        }
        let value = self.read_part(now, address)?;
        self.serve_dma(context.memory, now)?;
        let shift = 8 * (address & 3);
        Ok(value >> shift & (u64::from(u32::MAX) >> (32 - 8 * size.min(4))) as u32)
    }

    /// A store by the core.
    ///
    /// # Errors
    /// Where what is there is not modelled or not clocked, or does not take this.
    pub fn write(
        &mut self,
        context: &mut Context,
        address: u32,
        size: usize,
        value: u32,
    ) -> Result<(), String> {
        let now = context.now;
        if (0x0800_0000..0x0810_0000).contains(&address) {
            self.flash.reset_at = self.iwdg.next_event();
            let memory = &mut *context.memory;
            return self.flash.program(address, size, value, now, memory);
        }
        if let Some((word, bit)) = bit_band(address) {
            let old = self.read_part(now, word)?;
            let new = old & !(1 << bit) | (value & 1) << bit;
            return self.write_part(context.memory, now, word, 4, new);
        }
        self.write_part(context.memory, now, address, size, value)?;
        self.serve_dma(context.memory, now)
    }
}

/// The word and bit behind an address of the peripherals' bit-band alias.
const fn bit_band(address: u32) -> Option<(u32, u32)> {
    if address < 0x4200_0000 || address >= 0x4400_0000 {
        return None;
    }
    let byte = 0x4000_0000 + (address - 0x4200_0000) / 32;
    Some((byte & !3, 8 * (byte & 3) + (address % 32) / 4))
}

/// Seconds of virtual time.
#[must_use]
pub const fn seconds(count: u64) -> u64 {
    count * time::PER_SECOND
}
