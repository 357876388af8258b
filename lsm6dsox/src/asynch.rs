//! The driver over an [`AsyncBus`], which contains the driver's logic.
//!
//! [`crate::Lsm6dsox`] is the driver over the blocking traits. It runs these functions on a bus that is always ready,
//! so that no code is duplicated and no macro has to rewrite it.

use embedded_hal_async::delay::DelayNs;

use crate::bus::AsyncBus;
use crate::config::{Config, I3C_DISABLED, Write};
use crate::error::Error;
use crate::register::{self, Register, ctrl3_c, ctrl5_c};
use crate::sample::{RawSample, SAMPLE_BYTES, Status};
use crate::scale::FrequencyFine;
use crate::self_test::{self, SelfTest};

/// Time from power-up until the part answers, µs \[P example\].
pub const BOOT_MICROS: u32 = 10_000;

/// Time from the gyroscope's start until its samples are usable, µs. ST specifies up to 70 ms from power-down to high
/// performance for a sibling (AN5040, LSM6DSL, turn-on time). Its filter takes three more periods of the narrowest
/// cut-off of [`Params::FRESH_KILOHERTZ`](crate::Params::FRESH_KILOHERTZ). The first samples come after 35 ms \[D\].
pub const TURN_ON_MICROS: u32 = 80_000;

/// Interval between two polls of `SW_RESET`, µs.
const RESET_POLL_MICROS: u32 = 100;

/// Polls of `SW_RESET` until the reset counts as failed; 10 ms in total.
const RESET_POLLS: u32 = 100;

/// Polls of `STATUS_REG`, 1 ms apart, until a sample of the self-test counts as missing.
const DATA_READY_POLLS: u32 = 100;

/// An LSM6DSOX on SPI, mode 0 or 3, at most 10 MHz, or on I²C, at most 400 kHz \[D\].
#[derive(Debug)]
pub struct Lsm6dsox<BUS> {
    pub(crate) bus: BUS,
    /// Configuration to write; the scale of codes while the part holds it.
    config: Config,
    registers: Registers,
}

/// State of the part's registers, as far as the driver knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Registers {
    /// The registers held the driver's configuration when they were last read.
    Configured,
    /// Unknown, from before the first write that changes the configuration until all of it has been read back.
    Unknown,
}

impl<BUS: AsyncBus> Lsm6dsox<BUS> {
    /// Creates a driver without accessing the bus. Call [`init`](Self::init) next.
    pub const fn new(bus: BUS, config: Config) -> Self {
        Self { bus, config: config.on_bus(BUS::IS_I2C), registers: Registers::Unknown }
    }

    /// The configuration that [`init`](Self::init) writes.
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// The bus, to change its settings between two transfers.
    pub const fn bus(&mut self) -> &mut BUS {
        &mut self.bus
    }

    /// Releases the bus.
    pub fn release(self) -> BUS {
        self.bus
    }

    /// Brings the part from any state into the configuration, after which the next sample can be used. May be called
    /// again at any time.
    ///
    /// Waits for the part's boot; leaves other register banks, 3-wire SPI and I3C; checks the identity and resets the
    /// part; writes the configuration and reads it back; waits for the gyroscope's turn-on.
    ///
    /// # Errors
    /// The first register that does not hold the expected value.
    pub async fn init(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<BUS::Error>> {
        self.registers = Registers::Unknown;
        delay.delay_us(BOOT_MICROS).await;
        self.make_readable().await?;
        match self.check_identity().await {
            Err(Error::Identity { .. }) => {
                // Ends I3C mode. The end of the reset cannot be read in that mode, so the identity decides.
                let _ = self.reset(delay).await;
                self.check_identity().await?;
            }
            other => other?,
        }
        self.reset(delay).await?;
        let config = self.config;
        self.apply(&config).await?;
        delay.delay_us(TURN_ON_MICROS).await;
        self.registers = Registers::Configured;
        Ok(())
    }

    /// Changes the configuration and runs [`init`](Self::init).
    ///
    /// # Errors
    /// As [`init`](Self::init). Samples are unavailable until this function or [`init`](Self::init) has succeeded.
    pub async fn reconfigure(
        &mut self,
        config: Config,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<BUS::Error>> {
        self.config = config.on_bus(BUS::IS_I2C);
        self.init(delay).await
    }

    /// Checks that a part with the right identity answers.
    ///
    /// # Errors
    /// [`Error::Identity`] with the value read instead.
    pub async fn check_identity(&mut self) -> Result<(), Error<BUS::Error>> {
        let read = self.read(register::WHO_AM_I.address).await?;
        check_identity(read)
    }

    /// Checks the identity, and reads back the accelerometer's data rate. One transfer reads both, because their
    /// registers are neighbours.
    ///
    /// # Errors
    /// As [`check_identity`](Self::check_identity) and [`check`](Self::check).
    pub async fn check_identity_and_rate(&mut self) -> Result<(), Error<BUS::Error>> {
        const { assert!(register::WHO_AM_I.address + 1 == register::CTRL1_XL.address) };
        let mut frame = [register::WHO_AM_I.read_address(), 0, 0];
        self.transfer(&mut frame).await?;
        let [_, identity, rate] = frame;
        check_identity(identity)?;
        let is_rate = |write: &Write| write.register.address == register::CTRL1_XL.address;
        match self.config.writes().find(is_rate) {
            Some(write) => check_read_back(write, rate),
            None => Ok(()),
        }
    }

    /// Reads every register of the configuration back. Detects a part that a dip of its supply has reset unnoticed.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the first register that differs. Samples are unavailable until
    /// [`init`](Self::init) has succeeded.
    pub async fn verify(&mut self) -> Result<(), Error<BUS::Error>> {
        let config = self.config;
        let registers = core::mem::replace(&mut self.registers, Registers::Unknown);
        self.verify_as(&config).await?;
        self.registers = registers;
        Ok(())
    }

    /// Reads one register of [`Config::writes`] back. Use it where [`verify`](Self::verify) would take too long.
    ///
    /// # Errors
    /// [`Error::ReadBack`] if it differs.
    pub async fn check(&mut self, write: Write) -> Result<(), Error<BUS::Error>> {
        let read = self.read(write.register.address).await?;
        check_read_back(write, read)
    }

    /// Reads status, temperature, angular rate and specific force in one transfer of 17 bytes.
    ///
    /// # Errors
    /// [`Error::Status`] if the bytes read cannot be a sample, [`Error::Unconfigured`] if
    /// the part is not known to hold the configuration.
    pub async fn sample(&mut self) -> Result<RawSample, Error<BUS::Error>> {
        let config = *self.configured()?;
        self.sample_as(&config).await
    }

    /// Reads `STATUS_REG` alone.
    ///
    /// # Errors
    /// [`Error::Status`] if the byte read cannot be a status.
    pub async fn status(&mut self) -> Result<Status, Error<BUS::Error>> {
        let register = register::STATUS_REG;
        let read = self.read(register.address).await?;
        Status::from_bits(read).ok_or(Error::Status { register, read })
    }

    /// Reads the error of the part's clock.
    ///
    /// # Errors
    /// Errors of the bus.
    pub async fn frequency_fine(&mut self) -> Result<FrequencyFine, Error<BUS::Error>> {
        let read = self.read(register::INTERNAL_FREQ_FINE.address).await?;
        Ok(FrequencyFine(i8::from_le_bytes([read])))
    }

    /// Switches both sensors off. Samples are unavailable until [`init`](Self::init) switches
    /// them on again.
    ///
    /// # Errors
    /// [`Error::ReadBack`] with the data rate that was not accepted.
    pub async fn power_down(&mut self) -> Result<(), Error<BUS::Error>> {
        self.registers = Registers::Unknown;
        const OFF: [Write; 2] = [
            Write { register: &register::CTRL1_XL, value: 0 },
            Write { register: &register::CTRL2_G, value: 0 },
        ];
        for write in OFF {
            self.write(write.register.address, write.value).await?;
            self.check(write).await?;
        }
        Ok(())
    }

    /// Runs ST's self-test, then [`init`](Self::init). The part must lie still for a second.
    ///
    /// # Errors
    /// Errors of the bus and the registers. A part that fails its limits is a result, not an error.
    ///
    /// After an error the part may be under a test signal, so samples are unavailable until [`init`](Self::init) has
    /// succeeded.
    pub async fn self_test(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<SelfTest, Error<BUS::Error>> {
        let accel = ctrl5_c::ST_XL.place(self_test::ST_XL_NEGATIVE);
        let gyro = ctrl5_c::ST_G.place(self_test::ST_G_POSITIVE);
        self.registers = Registers::Unknown;
        self.make_readable().await?;
        self.check_identity().await?;
        let (off, on) =
            self.test_signal(&Config::ACCEL_SELF_TEST.on_bus(BUS::IS_I2C), accel, delay).await?;
        let specific_force = self_test::changes(off.specific_force, on.specific_force);
        let (off, on) =
            self.test_signal(&Config::GYRO_SELF_TEST.on_bus(BUS::IS_I2C), gyro, delay).await?;
        let angular_rate = self_test::changes(off.angular_rate, on.angular_rate);
        self.init(delay).await?;
        Ok(SelfTest { specific_force, angular_rate })
    }

    /// Returns the means of samples without and with a test signal.
    async fn test_signal(
        &mut self,
        config: &Config,
        signal: u8,
        delay: &mut impl DelayNs,
    ) -> Result<(Mean, Mean), Error<BUS::Error>> {
        self.reset(delay).await?;
        self.apply(config).await?;
        let off = self.settled_mean(config, delay).await?;
        self.write(register::CTRL5_C.address, signal).await?;
        let on = self.settled_mean(config, delay).await?;
        self.write(register::CTRL5_C.address, 0).await?;
        Ok((off, on))
    }

    async fn settled_mean(
        &mut self,
        config: &Config,
        delay: &mut impl DelayNs,
    ) -> Result<Mean, Error<BUS::Error>> {
        delay.delay_ms(self_test::SETTLING_MILLIS).await;
        self.next_sample(config, delay).await?;
        let mut mean = Mean::default();
        for _ in 0..self_test::SAMPLES {
            mean.add(&self.next_sample(config, delay).await?);
        }
        Ok(mean)
    }

    async fn next_sample(
        &mut self,
        config: &Config,
        delay: &mut impl DelayNs,
    ) -> Result<RawSample, Error<BUS::Error>> {
        let mut read = 0;
        for _ in 0..DATA_READY_POLLS {
            let sample = self.sample_as(config).await?;
            if sample.status.accel_fresh() || sample.status.gyro_fresh() {
                return Ok(sample);
            }
            read = sample.status.bits();
            delay.delay_ms(1).await;
        }
        Err(Error::DataReadyTimeout { read })
    }

    /// Writes the settings that prevent reading, without reading. In another bank `WHO_AM_I` is another register, and
    /// with 3-wire SPI the responses come on the part's input. Both persist until the part loses its supply.
    ///
    /// A part whose INT1 is high at its power-up or reset, even by a pulse of its own, answers only on I3C, but takes
    /// writes. A reset with I3C disabled ends that (STMicroelectronics/stm32-lsm6dso #1, Zephyr #20913, #39181) \[S\].
    async fn make_readable(&mut self) -> Result<(), Error<BUS::Error>> {
        self.write(register::FUNC_CFG_ACCESS.address, 0).await?;
        self.write(register::INT1_CTRL.address, 0).await?;
        self.write(register::CTRL9_XL.address, I3C_DISABLED).await?;
        self.write(register::CTRL3_C.address, self.config.params().ctrl3_c()).await
    }

    /// Resets the registers, with the gyroscope off and the accelerometer in high-performance mode: ST's order for this
    /// family \[S\].
    async fn reset(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<BUS::Error>> {
        self.write(register::CTRL2_G.address, 0).await?;
        self.write(register::CTRL6_C.address, 0).await?;
        let written = register::CTRL3_C.reset | ctrl3_c::SW_RESET.mask();
        self.write(register::CTRL3_C.address, written).await?;
        let mut unfinished = Error::ResetTimeout { written, read: written };
        for _ in 0..RESET_POLLS {
            delay.delay_us(RESET_POLL_MICROS).await;
            match self.read(register::CTRL3_C.address).await {
                Ok(read) if !ctrl3_c::SW_RESET.is_set(read) => return Ok(()),
                Ok(read) => unfinished = Error::ResetTimeout { written, read },
                // A part in its reset may not acknowledge its address on I²C.
                Err(error) => unfinished = error,
            }
        }
        Err(unfinished)
    }

    async fn apply(&mut self, config: &Config) -> Result<(), Error<BUS::Error>> {
        for Write { register, value } in config.writes() {
            self.write(register.address, value).await?;
        }
        self.verify_as(config).await
    }

    async fn verify_as(&mut self, config: &Config) -> Result<(), Error<BUS::Error>> {
        for write in config.writes() {
            self.check(write).await?;
        }
        Ok(())
    }

    /// Reads a burst, and decodes it into codes with the scales of `config`.
    async fn sample_as(&mut self, config: &Config) -> Result<RawSample, Error<BUS::Error>> {
        let mut frame = BURST;
        self.transfer(&mut frame).await?;
        let [_, bytes @ ..] = &frame;
        RawSample::decode(bytes, config)
            .map_err(|read| Error::Status { register: register::STATUS_REG, read })
    }

    /// Returns the configuration if the part is known to hold it. Without it the codes have no scale.
    fn configured(&self) -> Result<&Config, Error<BUS::Error>> {
        match self.registers {
            Registers::Configured => Ok(&self.config),
            Registers::Unknown => Err(Error::Unconfigured),
        }
    }

    async fn read(&mut self, address: u8) -> Result<u8, Error<BUS::Error>> {
        let mut frame = [address | Register::READ, 0];
        self.transfer(&mut frame).await?;
        let [_, value] = frame;
        Ok(value)
    }

    async fn write(&mut self, address: u8, value: u8) -> Result<(), Error<BUS::Error>> {
        Ok(self.bus.write(address, value).await?)
    }

    async fn transfer(&mut self, frame: &mut [u8]) -> Result<(), Error<BUS::Error>> {
        Ok(self.bus.read(frame).await?)
    }
}

fn check_identity<E>(read: u8) -> Result<(), Error<E>> {
    if read == register::WHO_AM_I.reset { Ok(()) } else { Err(Error::Identity { read }) }
}

fn check_read_back<E>(write: Write, read: u8) -> Result<(), Error<E>> {
    if write.register.agree(read, write.value) {
        Ok(())
    } else {
        Err(Error::ReadBack { register: *write.register, written: write.value, read })
    }
}

/// Request for a sample: an address, and space for the response.
const BURST: [u8; SAMPLE_BYTES + 1] = {
    let mut frame = [0; SAMPLE_BYTES + 1];
    let [address, ..] = &mut frame;
    *address = register::STATUS_REG.read_address();
    frame
};

/// Mean of the self-test's samples, SI.
#[derive(Default)]
struct Mean {
    specific_force: [f32; 3],
    angular_rate: [f32; 3],
}

impl Mean {
    fn add(&mut self, sample: &RawSample) {
        let add = |mean: &mut [f32; 3], values: [f32; 3]| {
            for (mean, value) in mean.iter_mut().zip(values) {
                *mean += value / f32::from(self_test::SAMPLES);
            }
        };
        add(&mut self.specific_force, sample.specific_force.to_si());
        add(&mut self.angular_rate, sample.angular_rate.to_si());
    }
}
