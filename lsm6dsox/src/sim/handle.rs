//! Shared handles to a part, for drivers and tests.

use core::cell::RefCell;
use core::convert::Infallible;
use core::fmt;
use std::rc::Rc;

use embedded_hal::i2c::{self, I2c, NoAcknowledgeSource, SevenBitAddress};
use embedded_hal::spi::{self, Operation, SpiDevice};

use super::fault::PartFault;
use super::part::Part;
use crate::bus::{BusSpeed, SetBusSpeed};
use crate::setting::Pin;

/// A part with several owners: the buses, the delay, and the observing test.
#[derive(Clone, Debug)]
pub struct SharedPart(Rc<RefCell<Part>>);

impl Part {
    /// Converts the part into a shared one, with handles for buses and a delay.
    #[must_use]
    pub fn shared(self) -> SharedPart {
        SharedPart(Rc::new(RefCell::new(self)))
    }
}

impl SharedPart {
    /// The part on SPI.
    #[must_use]
    pub fn spi(&self) -> SimSpi {
        SimSpi(self.clone())
    }

    /// The part on I²C.
    #[must_use]
    pub fn i2c(&self) -> SimI2c {
        SimI2c { part: self.clone(), address: 0 }
    }

    /// A delay that advances the part's time.
    #[must_use]
    pub fn delay(&self) -> SimDelay {
        SimDelay(self.clone())
    }

    /// Calls `f` with the part. The part must not be accessed through another handle meanwhile.
    pub fn with<T>(&self, f: impl FnOnce(&mut Part) -> T) -> T {
        f(&mut self.0.borrow_mut())
    }

    /// See [`Part::advance_to`].
    pub fn advance_to(&self, now_ns: u64) {
        self.with(|part| part.advance_to(now_ns));
    }

    /// Advances time by this duration, ns.
    pub fn advance_by(&self, ns: u64) {
        self.with(|part| part.advance_to(part.now_ns() + ns));
    }

    /// See [`Part::now_ns`].
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.with(|part| part.now_ns())
    }

    /// See [`Part::inject`].
    pub fn inject(&self, fault: PartFault) {
        self.with(|part| part.inject(fault));
    }

    /// See [`Part::pin_is_high`].
    #[must_use]
    pub fn pin_is_high(&self, pin: Pin) -> bool {
        self.with(|part| part.pin_is_high(pin))
    }

    /// See [`Part::next_rising_edge_ns`].
    #[must_use]
    pub fn next_rising_edge_ns(&self, pin: Pin) -> Option<u64> {
        self.with(|part| part.next_rising_edge_ns(pin))
    }
}

/// The part on SPI: the first byte of a transaction is an address, its top bit set to read.
#[derive(Clone, Debug)]
pub struct SimSpi(SharedPart);

impl spi::ErrorType for SimSpi {
    type Error = Infallible;
}

impl SpiDevice for SimSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let part = &mut *self.0.0.borrow_mut();
        part.select();
        for operation in operations {
            match operation {
                Operation::Write(out) => {
                    for byte in *out {
                        part.exchange(*byte);
                    }
                }
                Operation::Read(back) => {
                    for byte in back.iter_mut() {
                        *byte = part.exchange(0);
                    }
                }
                Operation::TransferInPlace(frame) => {
                    for byte in frame.iter_mut() {
                        *byte = part.exchange(*byte);
                    }
                }
                Operation::Transfer(back, out) => {
                    for i in 0..back.len().max(out.len()) {
                        let byte = part.exchange(out.get(i).copied().unwrap_or(0));
                        if let Some(back) = back.get_mut(i) {
                            *back = byte;
                        }
                    }
                }
                Operation::DelayNs(ns) => part.advance_to(part.now_ns() + u64::from(*ns)),
            }
        }
        part.deselect();
        Ok(())
    }
}

impl embedded_hal_async::spi::SpiDevice for SimSpi {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), Infallible> {
        SpiDevice::transaction(self, operations)
    }
}

impl SetBusSpeed for SimSpi {
    /// Passes the clock to the part; the time of a byte, if not zero, changes accordingly.
    fn set_bus_speed(&mut self, speed: BusSpeed) {
        self.0.with(|part| part.set_bus_clock(speed.spi_hertz()));
    }
}

/// The part on I²C at 0x6A: a write sets the register's address, then its value.
#[derive(Clone, Debug)]
pub struct SimI2c {
    part: SharedPart,
    address: u8,
}

impl SimI2c {
    /// Address of the part with its SA0 pin low \[P\].
    pub const ADDRESS: u8 = 0x6A;
}

/// No acknowledge: another address, or I²C is switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct I2cError;

impl fmt::Display for I2cError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no acknowledge")
    }
}

impl core::error::Error for I2cError {}

impl i2c::Error for I2cError {
    fn kind(&self) -> i2c::ErrorKind {
        i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
    }
}

impl i2c::ErrorType for SimI2c {
    type Error = I2cError;
}

impl I2c<SevenBitAddress> for SimI2c {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [i2c::Operation<'_>],
    ) -> Result<(), I2cError> {
        let part = &mut *self.part.0.borrow_mut();
        if address != Self::ADDRESS || !part.has_i2c() {
            return Err(I2cError);
        }
        for operation in operations {
            match operation {
                i2c::Operation::Write(out) => {
                    let Some((register, values)) = out.split_first() else {
                        continue;
                    };
                    self.address = register & 0x7F;
                    for value in values {
                        part.byte_time();
                        part.write_register(self.address, *value);
                        self.address = part.following(self.address);
                    }
                }
                i2c::Operation::Read(back) => {
                    for byte in back.iter_mut() {
                        part.byte_time();
                        *byte = part.read_bus(self.address);
                        self.address = part.following(self.address);
                    }
                }
            }
        }
        Ok(())
    }
}

impl embedded_hal_async::i2c::I2c<SevenBitAddress> for SimI2c {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [i2c::Operation<'_>],
    ) -> Result<(), I2cError> {
        I2c::transaction(self, address, operations)
    }
}

/// A delay that advances the part's time.
#[derive(Clone, Debug)]
pub struct SimDelay(SharedPart);

impl embedded_hal::delay::DelayNs for SimDelay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.advance_by(u64::from(ns));
    }
}

impl embedded_hal_async::delay::DelayNs for SimDelay {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.advance_by(u64::from(ns));
    }
}
