//! The sensor: its bus, its chip select, and INT1, whose edges a timer captures.

use lsm6dsox::setting::Pin;
use lsm6dsox::sim::Part as Sensor;

use super::Chip;
use crate::emulator::time::{NEVER, from_ns, to_ns};
use crate::emulator::wiring;

/// Timer behind each internal trigger 0 to 3 of these timers; the others are not modelled (RM0090, table 98).
const TRIGGERS: [[Option<usize>; 4]; 4] = [
    [None, None, Some(1), Some(2)],
    [None, Some(0), Some(3), Some(2)],
    [None, Some(0), Some(1), None],
    [Some(0), Some(1), Some(2), None],
];

/// Timer and channel, counted from 0, whose input a pin is in an alternate function (DS8626, table 9): of TIM2 in
/// function 1, of TIM5 in 2.
const fn timer_input(pin: wiring::ChipPin, function: u32) -> Option<(usize, usize)> {
    Some(match (pin.port, pin.number, function) {
        (0, 0 | 5 | 15, 1) => (0, 0),
        (0, 1, 1) | (1, 3, 1) => (0, 1),
        (0, 2, 1) | (1, 10, 1) => (0, 2),
        (0, 3, 1) | (1, 11, 1) => (0, 3),
        (0, channel @ 0..=3, 2) => (3, channel as usize),
        _ => return None,
    })
}

/// The bytes on the sensor's bus while its chip select was low.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transaction {
    /// Time of the falling edge of the chip select, in units of [`time`](crate::emulator::time).
    pub start: u64,
    /// Time of the end of the last byte.
    pub end: u64,
    /// Time of the last rising edge of the sensor's pin before the transaction.
    pub edge: Option<u64>,
    /// Bytes to the sensor.
    pub out: Vec<u8>,
    /// Bytes from the sensor.
    pub back: Vec<u8>,
}

impl Chip {
    /// Gives access to the sensor between transactions, to set or clear faults; then reads its pin again.
    pub fn with_sensor<T>(&mut self, now: u64, act: impl FnOnce(&mut Sensor) -> T) -> Option<T> {
        let sensor = self.sensor.as_mut()?;
        sensor.advance_to(to_ns(now));
        let result = act(sensor);
        self.watch_pin(now);
        Some(result)
    }

    /// Stops or restarts the clock on the sensor's bus.
    pub const fn set_sensor_clock_stopped(&mut self, stopped: bool, now: u64) {
        let index = self.wiring.spi;
        let pclk = self.spi_clock(index);
        self.spis[index].set_stopped(stopped, now, pclk);
    }

    /// Exchanges a byte with the sensor.
    pub(super) fn exchange(&mut self, out: u8, now: u64) -> u8 {
        // The data line then has the level of its pull.
        let data = self.wiring.sensor_bus[2].pin;
        let undriven = if self.ports[data.port].is_pulled_up(data.number) { 0xFF } else { 0 };
        let Some(sensor) = &mut self.sensor else {
            return undriven;
        };
        sensor.advance_to(to_ns(now));
        if !self.selected {
            return undriven;
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

    /// Advances the sensor to `now`, and processes each edge of its pin.
    pub(super) fn advance_sensor(&mut self, now: u64) {
        while self.sensor_edge <= now {
            let edge = self.sensor_edge;
            if let Some(sensor) = &mut self.sensor {
                let edge_ns = to_ns(edge);
                sensor.advance_to(edge_ns.saturating_sub(1));
                // An edge within a glitch counts, too.
                let low = !sensor.pin_is_high(Pin::Int1) || sensor.glitch_ns(Pin::Int1).is_some();
                if low && self.pin_high {
                    self.set_pin(false, NEVER, edge);
                }
                if let Some(sensor) = &mut self.sensor {
                    sensor.advance_to(edge_ns);
                }
            }
            self.watch_pin(edge);
            if self.sensor_edge == edge {
                // The edge was announced but did not occur, so it will be announced again.
                self.sensor_edge = NEVER;
            }
        }
    }

    /// Reads the level of the pin and the time of its next rising edge.
    pub(super) fn watch_pin(&mut self, now: u64) {
        let Some(sensor) = &self.sensor else {
            return;
        };
        let high = sensor.pin_is_high(Pin::Int1);
        let width = sensor.glitch_ns(Pin::Int1).map_or(NEVER, from_ns);
        self.sensor_edge = sensor.next_rising_edge_ns(Pin::Int1).map_or(NEVER, from_ns);
        if high != self.pin_high {
            self.set_pin(high, width, now);
        }
    }

    /// Sets the level of the pin for port, interrupt and timer capture. `width` is the duration of a high level that is
    /// a glitch.
    fn set_pin(&mut self, high: bool, width: u64, now: u64) {
        self.pin_high = high;
        if high {
            self.data_ready = Some(now);
        }
        let pin = self.wiring.data_ready;
        let port = &mut self.ports[pin.port];
        port.levels = port.levels & !(1 << pin.number) | u16::from(high) << pin.number;
        if port.mode(pin.number) == 2
            && let Some((timer, channel)) = timer_input(pin, port.function(pin.number))
            && self.timers[timer].edge(channel, high, width, now)
        {
            self.pulse(timer);
        }
    }

    /// Emits a pulse on a timer's trigger output.
    fn pulse(&mut self, master: usize) {
        for (timer, triggers) in self.timers.iter_mut().zip(TRIGGERS) {
            let input = timer.counts_trigger().map(|input| triggers[input as usize]);
            if input == Some(Some(master)) {
                timer.trigger();
            }
        }
    }

    /// Updates the chip select from its pin.
    pub(super) fn update_select(&mut self, now: u64) {
        // An input floats, and the sensor's pull-up holds the line.
        let pin = self.wiring.select;
        let port = &self.ports[pin.port];
        let low = port.mode(pin.number) == 1 && !port.level(pin.number);
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
        self.with_sensor(now, |sensor| if low { sensor.select() } else { sensor.deselect() });
    }

    /// Checks that the sensor is clocked over its pins, in mode 0 or 3 at 10 MHz at most.
    pub(super) fn check_sensor_bus(
        &mut self,
        index: usize,
        offset: u32,
        pclk: u32,
    ) -> Result<(), String> {
        if index != self.wiring.spi || offset != 0xC || !self.selected {
            return Ok(());
        }
        self.check_connections(&self.wiring.sensor_bus)?;
        let spi = &self.spis[index];
        let (rate, mode) = (spi.bit_rate(pclk), spi.mode());
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
}
