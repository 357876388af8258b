//! The portable part of the foot's program: everything except the pins.
//!
//! The path of a sample, one module a step:
//!
//! | step | module |
//! |---|---|
//! | a tick, a data-ready edge, one burst; is the sensor healthy? | [`sampling`] |
//! | the sensor's units and issues become the estimator's | [`lsm6dsox::imu`] |
//! | sample → estimate → frames, and all that is decided on the way | [`foot`] |
//! | frames go to the bus at once, or are queued; the newest win | [`outlet`], behind [`ports`] |
//!
//! And in the other direction, and in parallel:
//!
//! | what | module |
//! |---|---|
//! | bytes of the UART become requests, requests become answers | [`uart_requests`] |
//! | settings in flash | the crate [`storage`] |
//! | faults that come and go, liveness for the watchdog, the record of a crash | [`supervision`] |
//! | floats on a core without an instruction for them | [`float`] |
//! | lines of the program that measures a new board | [`bring_up`] |
//!
//! Two levels; the lower cannot delay the upper:
//!
//! - **The sampling loop** owns the sensor and the [`Foot`], and runs at
//!   interrupt priority: [`sampling::run`] calls [`Foot::tick`](foot::Foot::tick) once a
//!   millisecond, whatever the sensor does.
//! - **Everything else** moves bytes between the peripherals and [`Ports`], without a
//!   deadline. Ports are queues: short critical sections, no locks held across a wait.
//!
//! Interfaces that a board implements:
//!
//! | it provides | for |
//! |---|---|
//! | an `embedded_hal_async` `SpiDevice` and `DelayNs` | [`sampling::Sensor`] |
//! | [`sampling::Ticks`]: a timer and the captured edges | [`sampling::run`] |
//! | a function for [`Ports::connect_can`](ports::Ports::connect_can) that sends a frame at once, a task that calls [`Ports::send_can`](ports::Ports::send_can) for queued frames, one that puts received frames into [`Ports::put`](ports::Ports::put) | CAN |
//! | a task that takes [`Ports::take_uart`](ports::Ports::take_uart) to the line, one with a [`uart_requests::UartReceiver`] | UART |
//! | a task that serves [`Ports::next_request`](ports::Ports::next_request), with an `embedded_storage` `NorFlash` in [`storage::Storage`] | settings |
//! | a task that feeds the watchdog if [`supervision::Liveness::all_alive`] | supervision |
//!
//! No allocation, no `unsafe`, no `cfg`: hosts run the same code against the simulated sensor, with
//! `critical-section` on a mutex of the standard library.

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

pub mod bring_up;
pub mod costs;
pub mod float;
pub mod foot;
pub mod outlet;
pub mod ports;
pub mod sampling;
pub mod supervision;
pub mod uart_requests;

pub use foot::{Foot, STORES_AT_ONCE, Start};
pub use ports::Ports;
