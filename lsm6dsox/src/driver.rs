//! The driver over a blocking [`Bus`].
//!
//! Every method corresponds to one of [`asynch::Lsm6dsox`]. The bus is always ready, so a single poll completes each
//! call.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_hal::delay::DelayNs;

use crate::asynch;
use crate::bus::{AsyncBus, Bus};
use crate::config::{Config, Write};
use crate::error::Error;
use crate::sample::{RawSample, Status};
use crate::scale::FrequencyFine;
use crate::self_test::SelfTest;

/// Adapter from a blocking bus or delay to the asynchronous traits.
#[derive(Debug)]
struct Blocking<T>(T);

impl<BUS: Bus> AsyncBus for Blocking<BUS> {
    type Error = BUS::Error;

    const IS_I2C: bool = BUS::IS_I2C;

    async fn read(&mut self, frame: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(frame)
    }

    async fn write(&mut self, address: u8, value: u8) -> Result<(), Self::Error> {
        self.0.write(address, value)
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

/// Runs a future that never waits. Its first poll completes it; the loop avoids a panic.
fn run<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
    }
}

/// An LSM6DSOX on SPI, mode 0 or 3, at most 10 MHz, or on I²C, at most 400 kHz \[D\].
#[derive(Debug)]
pub struct Lsm6dsox<BUS> {
    inner: asynch::Lsm6dsox<Blocking<BUS>>,
}

impl<BUS: Bus> Lsm6dsox<BUS> {
    /// Creates a driver without accessing the bus. Call [`init`](Self::init) next.
    pub const fn new(bus: BUS, config: Config) -> Self {
        Self { inner: asynch::Lsm6dsox::new(Blocking(bus), config) }
    }

    /// The configuration that [`init`](Self::init) writes.
    pub const fn config(&self) -> &Config {
        self.inner.config()
    }

    /// Releases the bus.
    pub fn release(self) -> BUS {
        self.inner.release().0
    }

    /// Brings the part from any state into the configuration, after which the next sample can be used. May be called
    /// again at any time.
    ///
    /// Waits for the part's boot; leaves other register banks, 3-wire SPI and I3C; checks the identity and resets the
    /// part; writes the configuration and reads it back; waits for the gyroscope's turn-on.
    ///
    /// # Errors
    /// The first register that does not hold the expected value.
    pub fn init(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<BUS::Error>> {
        run(self.inner.init(&mut Blocking(delay)))
    }

    /// Changes the configuration and runs [`init`](Self::init).
    ///
    /// # Errors
    /// As [`init`](Self::init). Samples are unavailable until this function or [`init`](Self::init) has succeeded.
    pub fn reconfigure(
        &mut self,
        config: Config,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<BUS::Error>> {
        run(self.inner.reconfigure(config, &mut Blocking(delay)))
    }

    /// Checks that a part with the right identity answers.
    ///
    /// # Errors
    /// [`Error::Identity`] with the value read instead.
    pub fn check_identity(&mut self) -> Result<(), Error<BUS::Error>> {
        run(self.inner.check_identity())
    }

    /// Reads every register of the configuration back. Detects a part that a dip of its supply has reset unnoticed.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the first register that differs. Samples are unavailable until
    /// [`init`](Self::init) has succeeded.
    pub fn verify(&mut self) -> Result<(), Error<BUS::Error>> {
        run(self.inner.verify())
    }

    /// Reads one register of [`Config::writes`] back. Use it where [`verify`](Self::verify) would take too long.
    ///
    /// # Errors
    /// [`Error::ReadBack`] if it differs.
    pub fn check(&mut self, write: Write) -> Result<(), Error<BUS::Error>> {
        run(self.inner.check(write))
    }

    /// Reads status, temperature, angular rate and specific force in one transfer of 17 bytes.
    ///
    /// # Errors
    /// [`Error::Status`] if the bytes read cannot be a sample, [`Error::Unconfigured`] if
    /// the part is not known to hold the configuration.
    pub fn sample(&mut self) -> Result<RawSample, Error<BUS::Error>> {
        run(self.inner.sample())
    }

    /// Reads `STATUS_REG` alone.
    ///
    /// # Errors
    /// [`Error::Status`] if the byte read cannot be a status.
    pub fn status(&mut self) -> Result<Status, Error<BUS::Error>> {
        run(self.inner.status())
    }

    /// Reads the error of the part's clock.
    ///
    /// # Errors
    /// Errors of the bus.
    pub fn frequency_fine(&mut self) -> Result<FrequencyFine, Error<BUS::Error>> {
        run(self.inner.frequency_fine())
    }

    /// Switches both sensors off. Samples are unavailable until [`init`](Self::init) switches
    /// them on again.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the data rate that was not accepted.
    pub fn power_down(&mut self) -> Result<(), Error<BUS::Error>> {
        run(self.inner.power_down())
    }

    /// Runs ST's self-test, then [`init`](Self::init). The part must lie still for a second.
    ///
    /// # Errors
    /// Errors of the bus and the registers. A part that fails its limits is a result, not an error.
    ///
    /// After an error the part may be under a test signal, so samples are unavailable until [`init`](Self::init) has
    /// succeeded.
    pub fn self_test(&mut self, delay: &mut impl DelayNs) -> Result<SelfTest, Error<BUS::Error>> {
        run(self.inner.self_test(&mut Blocking(delay)))
    }
}
