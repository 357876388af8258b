//! I²C to the LSM6DSOX of the board.

use core::future::Future;

use embassy_rp::Peri;
use embassy_rp::gpio::{Flex, Pull};
use embassy_rp::i2c::{Async, Config, Error, I2c};
use embassy_time::{Duration, Timer, with_timeout};
use lsm6dsox::{AsyncBus, BusSpeed, I2c as SensorOnI2c, Sa0, SetBusSpeed};

use crate::board::{BUS_HERTZ, Clock, Controller, Data, Irqs};

/// Longest transfer: three times that of a sample at the slowest clock.
const LONGEST_TRANSFER: Duration = Duration::from_micros(3_000);

/// Number of clocks after which a part that holds the data line low has released it (UM10204, 3.1.16).
const RELEASING_CLOCKS: usize = 9;

/// Half a period of these clocks.
const HALF_CLOCK: Duration = Duration::from_micros(5);

/// Clock of the sensor's bus, Hz.
pub const fn bus_hertz(speed: BusSpeed) -> u32 {
    let [full, reduced, lowest] = BUS_HERTZ;
    match speed {
        BusSpeed::Full => full,
        BusSpeed::Reduced => reduced,
        BusSpeed::Lowest => lowest,
    }
}

/// Reason why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusError {
    /// The controller reported an error.
    Controller(Error),
    /// The transfer did not end in time.
    Timeout,
}

/// Pins and controller.
pub struct Parts {
    pub controller: Peri<'static, Controller>,
    pub data: Peri<'static, Data>,
    pub clock: Peri<'static, Clock>,
}

impl Parts {
    /// Duplicates the peripherals for a restart of the controller.
    fn again(&mut self) -> Self {
        // SAFETY: `SensorBus` drops the owner of the original peripherals before the duplicates are used.
        unsafe {
            Self {
                controller: self.controller.clone_unchecked(),
                data: self.data.clone_unchecked(),
                clock: self.clock.clone_unchecked(),
            }
        }
    }

    fn start(self, speed: BusSpeed) -> SensorOnI2c<I2c<'static, Controller, Async>> {
        let mut config = Config::default();
        config.frequency = bus_hertz(speed);
        let bus = I2c::new_async(self.controller, self.clock, self.data, Irqs, config);
        SensorOnI2c::new(bus, Sa0::Low)
    }
}

/// The sensor's bus.
pub struct SensorBus {
    parts: Parts,
    speed: BusSpeed,
    /// The running controller. Absent after a failed transfer.
    bus: Option<SensorOnI2c<I2c<'static, Controller, Async>>>,
}

impl SensorBus {
    pub const fn new(parts: Parts) -> Self {
        Self { parts, speed: BusSpeed::Full, bus: None }
    }

    /// Returns the running controller. If it is not running, frees the data line by clocks, then starts it.
    async fn running(&mut self) -> &mut SensorOnI2c<I2c<'static, Controller, Async>> {
        if self.bus.is_none() {
            release(&mut self.parts).await;
        }
        let (parts, speed) = (&mut self.parts, self.speed);
        self.bus.get_or_insert_with(|| parts.again().start(speed))
    }

    /// Result of a transfer. After a failure the next transfer restarts the controller.
    fn ended(
        &mut self,
        result: Result<Result<(), Error>, embassy_time::TimeoutError>,
    ) -> Result<(), BusError> {
        let result = match result {
            Ok(result) => result.map_err(BusError::Controller),
            Err(_) => Err(BusError::Timeout),
        };
        if result.is_err() {
            self.bus = None;
        }
        result
    }
}

impl AsyncBus for SensorBus {
    type Error = BusError;

    const IS_I2C: bool = true;

    async fn read(&mut self, frame: &mut [u8]) -> Result<(), BusError> {
        let transfer = self.running().await.read(frame);
        let result = within_limit(transfer).await;
        self.ended(result)
    }

    async fn write(&mut self, address: u8, value: u8) -> Result<(), BusError> {
        let transfer = self.running().await.write(address, value);
        let result = within_limit(transfer).await;
        self.ended(result)
    }
}

async fn within_limit<T>(
    transfer: impl Future<Output = T>,
) -> Result<T, embassy_time::TimeoutError> {
    with_timeout(LONGEST_TRANSFER, transfer).await
}

impl SetBusSpeed for SensorBus {
    fn set_bus_speed(&mut self, speed: BusSpeed) {
        self.speed = speed;
        self.bus = None;
    }
}

/// Clocks a part that holds the data line low until it releases the line.
async fn release(parts: &mut Parts) {
    let mut data = Flex::new(parts.data.reborrow());
    data.set_pull(Pull::Up);
    let mut clock = Flex::new(parts.clock.reborrow());
    clock.set_pull(Pull::Up);
    clock.set_low();
    for _ in 0..RELEASING_CLOCKS {
        if data.is_high() {
            return;
        }
        clock.set_as_output();
        Timer::after(HALF_CLOCK).await;
        clock.set_as_input();
        Timer::after(HALF_CLOCK).await;
    }
}
