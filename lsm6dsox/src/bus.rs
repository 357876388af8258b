//! The part's buses: SPI (any `SpiDevice`), with its mode and clock, and I²C.

use embedded_hal::spi::{MODE_3, Mode};
use embedded_hal::{i2c, spi};

use crate::register::Register;

/// A blocking bus of the part: any [`SpiDevice`](spi::SpiDevice), or an [`I2c`].
pub trait Bus {
    /// Error of a transfer.
    type Error;

    /// Whether the part keeps its I²C interface.
    const IS_I2C: bool;

    /// Reads registers into all bytes of `frame` but the first. The first byte is the address of the first
    /// register, with [`Register::READ`].
    ///
    /// # Errors
    /// The transfer failed.
    fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes a register.
    ///
    /// # Errors
    /// The transfer failed.
    fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error>;
}

/// An asynchronous bus of the part: any `embedded_hal_async::spi::SpiDevice`, or an [`I2c`].
pub trait AsyncBus {
    /// See [`Bus::Error`].
    type Error;

    /// See [`Bus::IS_I2C`].
    const IS_I2C: bool;

    /// See [`Bus::read`].
    fn read(&mut self, frame: &mut [u8]) -> impl Future<Output = Result<(), Self::Error>>;

    /// See [`Bus::write`].
    fn write(&mut self, address: u8, value: u8) -> impl Future<Output = Result<(), Self::Error>>;
}

impl<SPI: spi::SpiDevice> Bus for SPI {
    type Error = SPI::Error;

    const IS_I2C: bool = false;

    fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error> {
        self.transfer_in_place(frame)
    }

    fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error> {
        spi::SpiDevice::write(self, &[address, value])
    }
}

impl<SPI: embedded_hal_async::spi::SpiDevice> AsyncBus for SPI {
    type Error = SPI::Error;

    const IS_I2C: bool = false;

    async fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error> {
        self.transfer_in_place(frame).await
    }

    async fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error> {
        embedded_hal_async::spi::SpiDevice::write(self, &[address, value]).await
    }
}

/// SPI mode of the part; mode 0 works as well \[D\].
pub const SPI_MODE: Mode = MODE_3;

/// Largest clock of the part's SPI, Hz \[D\]. Clock dividers that round up exceed it.
///
/// On a sibling the data line is valid up to 50 ns after the clock's edge (LSM6DSL, SPI slave timing, `tv(SO)`). That
/// is the whole half period, so at this clock a slow part leaves the master no setup time. [`BusSpeed::Full`] leaves 50
/// ns.
pub const SPI_MAX_HERTZ: u32 = 10_000_000;

/// Speed of the part's bus, slowest first. A board with SPI has the clocks of [`BusSpeed::spi_hertz`], one with I²C chooses
/// its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusSpeed {
    /// The lowest speed. SPI, at a quarter of its full clock, leaves room for clock edges of 200 ns.
    Lowest,
    /// A speed between the others. SPI, at half of its full clock, leaves room for a data line slower than that of any
    /// part, as with long wires or level shifters.
    Reduced,
    /// The full speed.
    #[default]
    Full,
}

impl BusSpeed {
    /// All speeds, slowest first.
    pub const ALL: [Self; 3] = [Self::Lowest, Self::Reduced, Self::Full];

    /// Clock of SPI, Hz: half of [`SPI_MAX_HERTZ`] at full speed, then a quarter and an eighth.
    #[must_use]
    pub const fn spi_hertz(self) -> u32 {
        match self {
            Self::Full => SPI_MAX_HERTZ / 2,
            Self::Reduced => SPI_MAX_HERTZ / 4,
            Self::Lowest => SPI_MAX_HERTZ / 8,
        }
    }

    /// The next faster speed, or the fastest.
    #[must_use]
    pub const fn faster(self) -> Self {
        match self {
            Self::Lowest => Self::Reduced,
            Self::Reduced | Self::Full => Self::Full,
        }
    }

    /// The next slower speed, or the slowest.
    #[must_use]
    pub const fn slower(self) -> Self {
        match self {
            Self::Full => Self::Reduced,
            Self::Reduced | Self::Lowest => Self::Lowest,
        }
    }
}

/// A bus whose speed can be reduced.
pub trait SetBusSpeed {
    /// Limits the speed of the following transfers.
    fn set_bus_speed(&mut self, speed: BusSpeed);
}

/// Level of the part's pin SA0, the last bit of its address on I²C \[P\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sa0 {
    /// Address 0x6A.
    #[default]
    Low,
    /// Address 0x6B.
    High,
}

/// The part on an I²C bus, at most 400 kHz \[D\]. Its pin CS is high.
#[derive(Debug)]
pub struct I2c<BUS> {
    bus: BUS,
    sa0: Sa0,
}

impl<BUS> I2c<BUS> {
    /// Creates a bus for a driver, without a transfer.
    pub const fn new(bus: BUS, sa0: Sa0) -> Self {
        Self { bus, sa0 }
    }

    /// The bus, to change its settings between two transfers.
    pub const fn bus(&mut self) -> &mut BUS {
        &mut self.bus
    }

    /// Releases the bus.
    pub fn release(self) -> BUS {
        self.bus
    }

    const fn address(&self) -> u8 {
        match self.sa0 {
            Sa0::Low => 0x6A,
            Sa0::High => 0x6B,
        }
    }
}

impl<BUS: i2c::I2c> Bus for I2c<BUS> {
    type Error = BUS::Error;

    const IS_I2C: bool = true;

    fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error> {
        match frame.split_first_mut() {
            Some((first, bytes)) => {
                self.bus.write_read(self.address(), &[*first & !Register::READ], bytes)
            }
            None => Ok(()),
        }
    }

    fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error> {
        self.bus.write(self.address(), &[address, value])
    }
}

impl<BUS: embedded_hal_async::i2c::I2c> AsyncBus for I2c<BUS> {
    type Error = BUS::Error;

    const IS_I2C: bool = true;

    async fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error> {
        match frame.split_first_mut() {
            Some((first, bytes)) => {
                self.bus.write_read(self.address(), &[*first & !Register::READ], bytes).await
            }
            None => Ok(()),
        }
    }

    async fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error> {
        self.bus.write(self.address(), &[address, value]).await
    }
}
