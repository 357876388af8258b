//! Errors of the sensor's bus at each clock.

use embassy_stm32::pac::SPI1;
use embassy_stm32::pac::spi::vals::Br;
use embedded_hal_async::spi::{Operation, SpiDevice};
use firmware::bring_up::Verdict;
use lsm6dsox::register::X_OFS_USR;
use lsm6dsox::{BusSpeed, SetBusSpeed};
use wire::Diagnosis;

use super::Out;
use crate::sensor::SensorBus;
use crate::wiring::SENSOR_SPEED;

/// Reads of each pattern at each clock of the sensor's bus (10⁵ in all), and number of wrong reads that ends them.
const READS: u32 = 25_000;
const ENOUGH: u32 = 1_000;

/// Bytes written and read back. They go to the user offsets, which the start of the sensor clears.
const PATTERNS: [[u8; 3]; 4] =
    [[0x00, 0xFF, 0x00], [0x55, 0xAA, 0x55], [0xFF, 0x00, 0xFF], [0x33, 0x0F, 0xC9]];

/// Returns the number of wrong or failed reads at the present clock of the bus, and the number of all reads.
async fn misreads(bus: &mut SensorBus) -> (u32, u32) {
    let (mut wrong, mut reads) = (0, 0);
    for pattern in PATTERNS {
        let [x, y, z] = pattern;
        let mut bytes = [X_OFS_USR.address, x, y, z];
        let write = &mut [Operation::TransferInPlace(&mut bytes)];
        let is_written = bus.transaction(write).await.is_ok();
        for _ in 0..READS {
            let mut bytes = [X_OFS_USR.read_address(), 0, 0, 0];
            let read = &mut [Operation::TransferInPlace(&mut bytes)];
            let is_read = bus.transaction(read).await.is_ok();
            let [_, bytes @ ..] = bytes;
            wrong += u32::from(!(is_written && is_read && bytes == pattern));
            reads += 1;
            if wrong >= ENOUGH {
                return (wrong, reads);
            }
            // Gives the task that feeds the watchdog a turn.
            embassy_futures::yield_now().await;
        }
    }
    (wrong, reads)
}

/// Measures the sensor's bus at the foot's clocks, and at the limit of the part. Leaves the bus at the fastest of the
/// foot's clocks without an error.
pub(super) async fn measure(out: &mut Out, bus: &mut SensorBus, diagnosis: &mut Diagnosis) {
    let mut fastest = None;
    for (speed, errors) in BusSpeed::ALL.into_iter().zip(&mut diagnosis.bus_errors) {
        bus.set_bus_speed(speed);
        let (wrong, reads) = misreads(bus).await;
        *errors = wrong.min(u32::from(u16::MAX)) as u16;
        if wrong == 0 {
            fastest = Some(speed);
        }
        let verdict = if wrong > 0 && speed > SENSOR_SPEED {
            Verdict::NotTested("the foot starts slower")
        } else {
            Verdict::when(wrong == 0, "wires of SPI and CS; supply of the sensor")
        };
        let name = match speed {
            BusSpeed::Lowest => "sensor's bus, 1.25 MHz",
            BusSpeed::Reduced => "sensor's bus, 2.5 MHz",
            BusSpeed::Full => "sensor's bus, 5 MHz",
        };
        let value = format_args!("{wrong} of {reads} wrong");
        out.line(name, value, "0", verdict).await;
    }
    SPI1.cr1().modify(|w| w.set_spe(false));
    // APB2 runs at 80 MHz.
    SPI1.cr1().modify(|w| w.set_br(Br::DIV8));
    SPI1.cr1().modify(|w| w.set_spe(true));
    let (wrong, reads) = misreads(bus).await;
    let verdict =
        if wrong == 0 { Verdict::Pass } else { Verdict::NotTested("the foot does not use it") };
    let value = format_args!("{wrong} of {reads} wrong");
    out.line("sensor's bus, 10 MHz", value, "0", verdict).await;
    let khz = |speed: BusSpeed| speed.spi_hertz() / 1_000;
    out.line(
        "sensor's clock",
        format_args!("{} kHz without error", fastest.map_or(0, khz)),
        "",
        Verdict::when(
            fastest >= Some(SENSOR_SPEED),
            "the foot slows down by itself: shorter wires",
        ),
    )
    .await;
    let in_use = fastest.unwrap_or(SENSOR_SPEED);
    diagnosis.bus_clock = in_use as u8;
    bus.set_bus_speed(in_use);
}
