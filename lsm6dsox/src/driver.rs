//! The driver over `embedded_hal::spi::SpiDevice`.
//!
//! Every method is the one of [`asynch::Lsm6dsox`] on a bus whose every
//! answer is there at once: polling it a single time runs it to its end.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, MODE_3, Mode, Operation, SpiDevice};

use crate::asynch;
use crate::config::{Config, Write};
use crate::error::Error;
use crate::fifo::{FifoBatch, FifoStatus, WordBytes};
use crate::sample::{RawSample, Status};
use crate::self_test::SelfTest;
use crate::timestamp::{FrequencyFine, SensorTimestamp};

/// How the part's SPI is clocked; mode 0 does too \[D\].
pub const SPI_MODE: Mode = MODE_3;

/// The fastest clock of the part's SPI, Hz \[D\]. Clock dividers that round up go beyond it.
///
/// On a sibling the data line is valid up to 50 ns after the clock's edge (LSM6DSL, SPI slave timing,
/// `tv(SO)`), which is the whole half period: at this clock a slow part leaves the master's setup time
/// nothing. [`SpiClock::Half`] leaves 50 ns.
pub const SPI_MAX_HERTZ: u32 = 10_000_000;

/// The clock of the part's SPI.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SpiClock {
    /// [`SPI_MAX_HERTZ`].
    #[default]
    Full,
    /// Half of it.
    Half,
}

impl SpiClock {
    /// Hz.
    #[must_use]
    pub const fn hertz(self) -> u32 {
        match self {
            Self::Full => SPI_MAX_HERTZ,
            Self::Half => SPI_MAX_HERTZ / 2,
        }
    }
}

/// A bus whose clock can be slowed down.
pub trait SetSpiClock {
    /// Transfers from now on run at no more than this clock.
    fn set_spi_clock(&mut self, clock: SpiClock);
}

/// A blocking bus or delay with the face of an asynchronous one.
#[derive(Debug)]
struct Blocking<T>(T);

impl<SPI: ErrorType> ErrorType for Blocking<SPI> {
    type Error = SPI::Error;
}

impl<SPI: SpiDevice> embedded_hal_async::spi::SpiDevice for Blocking<SPI> {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), SPI::Error> {
        self.0.transaction(operations)
    }
}

impl<D: DelayNs> embedded_hal_async::delay::DelayNs for Blocking<&mut D> {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.delay_ns(ns);
    }

    async fn delay_us(&mut self, us: u32) {
        self.0.delay_us(us);
    }

    async fn delay_ms(&mut self, ms: u32) {
        self.0.delay_ms(ms);
    }
}

/// Runs a future that never waits.
fn run<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
    }
}

/// An LSM6DSOX on SPI, mode 0 or 3, at most 10 MHz \[D\].
#[derive(Debug)]
pub struct Lsm6dsox<SPI> {
    inner: asynch::Lsm6dsox<Blocking<SPI>>,
}

impl<SPI: SpiDevice> Lsm6dsox<SPI> {
    /// A driver that has not touched the bus; [`init`](Self::init) comes next.
    pub const fn new(spi: SPI, config: Config) -> Self {
        Self {
            inner: asynch::Lsm6dsox::new(Blocking(spi), config),
        }
    }

    /// The configuration that [`init`](Self::init) writes.
    pub const fn config(&self) -> &Config {
        self.inner.config()
    }

    /// Gives the bus back.
    pub fn release(self) -> SPI {
        self.inner.release().0
    }

    /// Brings the part from any state into the configuration: waits for its boot, leaves other
    /// register banks and 3-wire SPI, checks its identity, resets it, writes the configuration and
    /// reads it back, and waits for the gyroscope's turn-on: the next sample can be used. May be
    /// called again at any time.
    ///
    /// # Errors
    /// The first register that does not hold what it should.
    pub fn init(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<SPI::Error>> {
        run(self.inner.init(&mut Blocking(delay)))
    }

    /// Changes the configuration; [`init`](Self::init) with another one.
    ///
    /// # Errors
    /// As [`init`](Self::init). There are no samples then until one of the two has succeeded.
    pub fn reconfigure(
        &mut self,
        config: Config,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<SPI::Error>> {
        run(self.inner.reconfigure(config, &mut Blocking(delay)))
    }

    /// Whether a part with the right identity answers.
    ///
    /// # Errors
    /// [`Error::Identity`] with what was read instead.
    pub fn check_identity(&mut self) -> Result<(), Error<SPI::Error>> {
        run(self.inner.check_identity())
    }

    /// Reads every register of the configuration back. A part that was reset behind the driver's
    /// back, by a dip of its supply, shows here.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the first register that differs. There are no samples then until
    /// [`init`](Self::init) has succeeded.
    pub fn verify(&mut self) -> Result<(), Error<SPI::Error>> {
        run(self.inner.verify())
    }

    /// Reads one register of [`Config::writes`] back: a look at a time, where
    /// [`verify`](Self::verify) would take too long.
    ///
    /// # Errors
    /// [`Error::ReadBack`] where it differs.
    pub fn check(&mut self, write: Write) -> Result<(), Error<SPI::Error>> {
        run(self.inner.check(write))
    }

    /// Reads status, temperature, angular rate and specific force in one transfer of 17 bytes.
    ///
    /// # Errors
    /// [`Error::Status`] where what came back cannot be a sample, [`Error::Unconfigured`] where
    /// the part is not known to hold the configuration.
    pub fn sample(&mut self) -> Result<RawSample, Error<SPI::Error>> {
        run(self.inner.sample())
    }

    /// Reads `STATUS_REG` alone.
    ///
    /// # Errors
    /// [`Error::Status`] where what came back cannot be a status.
    pub fn status(&mut self) -> Result<Status, Error<SPI::Error>> {
        run(self.inner.status())
    }

    /// Reads the part's 25 µs counter.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn timestamp(&mut self) -> Result<SensorTimestamp, Error<SPI::Error>> {
        run(self.inner.timestamp())
    }

    /// Sets the part's 25 µs counter to zero.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn reset_timestamp(&mut self) -> Result<(), Error<SPI::Error>> {
        run(self.inner.reset_timestamp())
    }

    /// Reads by how much the part's clock is off.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn frequency_fine(&mut self) -> Result<FrequencyFine, Error<SPI::Error>> {
        run(self.inner.frequency_fine())
    }

    /// Reads the FIFO's level and alarms. Reading clears the note of an overrun.
    ///
    /// # Errors
    /// [`Error::Status`] where what came back cannot be a status.
    pub fn fifo_status(&mut self) -> Result<FifoStatus, Error<SPI::Error>> {
        run(self.inner.fifo_status())
    }

    /// Reads the FIFO's status and then, in one transfer, as many words as there are and as fit
    /// into `buffer`.
    ///
    /// # Errors
    /// [`Error::Status`] where what came back cannot be a status, [`Error::Unconfigured`] where
    /// the part is not known to hold the configuration.
    pub fn read_fifo<'a>(
        &mut self,
        buffer: &'a mut [WordBytes],
    ) -> Result<FifoBatch<'a>, Error<SPI::Error>> {
        run(self.inner.read_fifo(buffer))
    }

    /// Switches both sensors off. [`init`](Self::init) switches them on again; until then there
    /// are no samples.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the data rate that did not take.
    pub fn power_down(&mut self) -> Result<(), Error<SPI::Error>> {
        run(self.inner.power_down())
    }

    /// Runs ST's self-test, then [`init`](Self::init). The part must lie still for a second.
    ///
    /// # Errors
    /// Those of the bus and the registers; a part that fails its limits is a result, not an error.
    /// After an error the part may be under a test signal: there are no samples until
    /// [`init`](Self::init) has succeeded.
    pub fn self_test(&mut self, delay: &mut impl DelayNs) -> Result<SelfTest, Error<SPI::Error>> {
        run(self.inner.self_test(&mut Blocking(delay)))
    }
}
