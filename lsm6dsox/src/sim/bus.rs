//! Bus interface of the part: reads and writes of registers, byte by byte.

use super::memory::Bank;
use super::outputs::Phase;
use super::part::{Busy, Part};
use crate::register::{self, Access, Register, ctrl3_c, ctrl4_c, ctrl5_c, func_cfg_access};

/// Setup time of the master before the sampling edge, ns: of the order given in
/// STM32's data sheets (assumed).
const SETUP_NS: u32 = 5;

impl Part {
    /// Drives chip select low: the next byte is an address, its top bit set to read.
    pub const fn select(&mut self) {
        self.phase = Phase::Address;
    }

    /// Drives chip select high.
    pub const fn deselect(&mut self) {
        self.phase = Phase::Idle;
    }

    /// Sets the clock with which the master reads from now on, Hz. If its half period is shorter than
    /// [`least_half_period_ns`](Self::least_half_period_ns), every bit is read one clock late.
    pub const fn set_bus_clock(&mut self, hertz: u32) {
        self.bus_clock_hertz = Some(hertz);
        if self.options.byte_time_ns > 0 && hertz > 0 {
            self.options.byte_time_ns = (8_000_000_000 / hertz as u64) as u32;
        }
    }

    /// Least time from the clock's shifting edge to its sampling edge with which the part's data are
    /// read correctly, ns: the part's delay and the master's setup time.
    #[must_use]
    pub fn least_half_period_ns(&self) -> u32 {
        self.faults.sdo_delay_ns.unwrap_or(self.options.sdo_delay_ns) + SETUP_NS
    }

    /// Returns whether the data line lags the master's clock.
    fn is_late(&self) -> bool {
        let half_period_ns = |hertz: u32| 500_000_000 / hertz.max(1);
        self.bus_clock_hertz
            .is_some_and(|hertz| half_period_ns(hertz) < self.least_half_period_ns())
    }

    /// Exchanges one byte with the master. While chip select is high, and with 3-wire SPI or in I3C mode
    /// always, no part drives the data line: [`open_line`](super::PartOptions::open_line).
    pub fn exchange(&mut self, out: u8) -> u8 {
        let byte = self.answer(out);
        if self.i3c || ctrl3_c::SIM.is_set(self.memory.get(register::CTRL3_C)) {
            return self.faults.stuck.unwrap_or(self.options.open_line);
        }
        if !self.is_late() {
            return byte;
        }
        let late = self.late_bit << 7 | byte >> 1;
        self.late_bit = byte & 1;
        self.faults.stuck.unwrap_or(late)
    }

    /// Returns the byte that the part shifts out while `out` comes in.
    fn answer(&mut self, out: u8) -> u8 {
        self.byte_time();
        match self.phase {
            Phase::Idle => self.options.open_line,
            Phase::Address => {
                let address = out & !Register::READ;
                self.phase = if out & Register::READ == 0 {
                    Phase::Writing(address)
                } else {
                    Phase::Reading(address)
                };
                0
            }
            Phase::Reading(address) => {
                self.phase = Phase::Reading(self.following(address));
                self.read_bus(address)
            }
            Phase::Writing(address) => {
                self.phase = Phase::Writing(self.following(address));
                self.write_register(address, out);
                0
            }
        }
    }

    /// Returns whether the part answers on I²C.
    pub(super) fn has_i2c(&self) -> bool {
        !ctrl4_c::I2C_DISABLE.is_set(self.memory.get(register::CTRL4_C))
    }

    /// Returns the address that follows in a burst.
    pub(super) fn following(&self, address: u8) -> u8 {
        let increments = ctrl3_c::IF_INC.is_set(self.memory.get(register::CTRL3_C));
        if !increments { address } else { self.rounded(address).unwrap_or((address + 1) & 0x7F) }
    }

    /// Returns the address to which a burst wraps from the last output, by `ROUNDING` in `CTRL5_C`.
    fn rounded(&self, address: u8) -> Option<u8> {
        const LAST_GYRO: u8 = register::OUTX_L_A.address - 1;
        const LAST_ACCEL: u8 = register::OUTZ_H_A.address;
        let rounding = ctrl5_c::ROUNDING.of(self.memory.get(register::CTRL5_C));
        match (rounding, address) {
            (0b01, LAST_ACCEL) => Some(register::OUTX_L_A.address),
            (0b10, LAST_GYRO) | (0b11, LAST_ACCEL) => Some(register::OUTX_L_G.address),
            _ => None,
        }
    }

    /// Advances time by one byte on the bus.
    pub(super) fn byte_time(&mut self) {
        if self.options.byte_time_ns > 0 {
            self.advance_to(self.now_ns + u64::from(self.options.byte_time_ns));
        }
    }

    /// Returns a byte as received by the master, with the faults of the line.
    pub(super) fn read_bus(&mut self, address: u8) -> u8 {
        let mut byte = self.read_register(address);
        if self.faults.reserved_bits
            && let Some(register) = register::ALL.iter().find(|r| r.address == address)
            && register.access == Access::ReadWrite
        {
            byte ^= !register.mask;
        }
        if self.faults.flips_per_million > 0 {
            for bit in 0..8 {
                byte ^= u8::from(self.flips.chance(self.faults.flips_per_million)) << bit;
            }
        }
        self.faults.stuck.unwrap_or(byte)
    }

    fn read_register(&mut self, address: u8) -> u8 {
        const OUT: u8 = register::OUT_TEMP_L.address;
        const OUT_END: u8 = register::OUTZ_H_A.address;
        const IS: fn(Register) -> u8 = |register| register.address;
        match self.busy {
            Some((Busy::Boot, _)) => return 0,
            Some((Busy::Reset, _)) if address == IS(register::CTRL3_C) => {
                return register::CTRL3_C.reset | ctrl3_c::SW_RESET.mask();
            }
            _ => {}
        }
        if let Some(bank) = self.other_bank(address) {
            return self.memory.read_other(bank, address);
        }
        match address {
            OUT..=OUT_END => self.words.read(address - OUT),
            _ if address == IS(register::STATUS_REG) => self.words.status(),
            _ if address == IS(register::WHO_AM_I) => {
                self.faults.id.unwrap_or(register::WHO_AM_I.reset)
            }
            _ if address == IS(register::INTERNAL_FREQ_FINE) => {
                let steps = libm::floor(self.options.clock_error / 0.0015 + 0.5);
                // The cast saturates at the range of the register.
                (steps as i8).to_le_bytes()[0]
            }
            _ => self.memory.read(address),
        }
    }

    /// Handles a byte written by the master.
    pub(super) fn write_register(&mut self, address: u8, value: u8) {
        if self.busy.is_some() {
            return;
        }
        if let Some(bank) = self.other_bank(address) {
            return self.memory.write_other(bank, address, value);
        }
        self.memory.write(address, value);
        self.act_on(address, value);
    }

    /// Returns the bank that an address refers to, if it is not the one described in
    /// [`register`](crate::register): that of the embedded functions or of the sensor hub.
    fn other_bank(&self, address: u8) -> Option<Bank> {
        const SENSOR_HUB: u8 = 0b01;
        if address == register::FUNC_CFG_ACCESS.address {
            return None;
        }
        let access = self.memory.get(register::FUNC_CFG_ACCESS);
        match func_cfg_access::REG_ACCESS.of(access) {
            0 => None,
            SENSOR_HUB => Some(Bank::SensorHub),
            _ => Some(Bank::EmbeddedFunctions),
        }
    }

    /// Changes bits of a register behind the bus's back.
    pub(super) fn flip(&mut self, address: u8, bits: u8) {
        let value = self.memory.read(address) ^ bits;
        self.memory.force(address, value);
        self.act_on(address, value);
    }

    /// Applies the effect of a register's new value.
    fn act_on(&mut self, address: u8, value: u8) {
        if address == register::CTRL3_C.address && ctrl3_c::BOOT.is_set(value) {
            return self.reboot();
        }
        if address == register::CTRL3_C.address && ctrl3_c::SW_RESET.is_set(value) {
            return self.software_reset();
        }
        self.settings_changed();
    }
}
