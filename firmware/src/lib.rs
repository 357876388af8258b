//! The portable part of what runs on the foot: everything but the pins.
//!
//! The path of a sample, one module a step:
//!
//! | step | module |
//! |---|---|
//! | a tick, a data-ready edge, one burst; is the sensor still itself? | [`sampling`] |
//! | the sensor's units and doubts become the estimator's | [`imu`] |
//! | sample → estimate → frames, and all that is decided on the way | [`pipeline`] |
//! | frames go to the bus at once, or wait; the newest win | [`telemetry`], behind [`ports`] |
//!
//! And what goes the other way, or happens beside it:
//!
//! | what | module |
//! |---|---|
//! | bytes of the UART become requests, requests become answers | [`commands`] |
//! | settings in flash | [`storage`] |
//! | faults that come and go, the watchdog's food, what a crash leaves behind | [`supervision`] |
//! | the estimator's bits on the target | [`self_check`] |
//!
//! Two levels, and nothing of the lower can delay the upper:
//!
//! - **The sampling loop** owns the sensor and the [`Foot`], and runs at
//!   interrupt priority: [`sampling::run`] calls [`Foot::tick`](pipeline::Foot::tick) once a
//!   millisecond, whatever the sensor does.
//! - **Everything else** moves bytes between the peripherals and [`Ports`], as slowly
//!   as it likes. Ports are queues: short critical sections, no locks held across a wait.
//!
//! What a board has to bring, and no more:
//!
//! | it brings | for |
//! |---|---|
//! | an `embedded_hal_async` `SpiDevice` and `DelayNs` | [`sampling::Sensor`] |
//! | [`sampling::Ticks`]: a timer and the captured edges | [`sampling::run`] |
//! | a [`Bus`](ports::Bus) that takes frames at once, a task that has [`Ports::send_can`](ports::Ports::send_can) send what waits, one that puts what it received into [`Ports::put`](ports::Ports::put) | CAN |
//! | a task that takes [`Ports::take_uart`](ports::Ports::take_uart) to the line, one with a [`commands::UartReceiver`] | UART |
//! | a task that does what [`Ports::next_request`](ports::Ports::next_request) asks for, with an `embedded_storage` `NorFlash` in [`storage::Storage`] | settings |
//! | a task that feeds the watchdog where [`supervision::Progress`] says so | supervision |
//!
//! No allocation, no `unsafe`, no `cfg`: hosts run the same code against the simulated sensor.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

pub mod commands;
pub mod imu;
pub mod pipeline;
pub mod ports;
pub mod sampling;
pub mod self_check;
pub mod storage;
pub mod supervision;
pub mod telemetry;

pub use pipeline::{Foot, Start};
pub use ports::Ports;
