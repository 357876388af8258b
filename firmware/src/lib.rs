//! The portable part of the foot's program: everything except the chip and its pins.
//!
//! The path of a sample, one module per step:
//!
//! | step | module |
//! |---|---|
//! | wait for a tick and a data-ready edge, read one burst, check the sensor's health | [`sampling`]; on the STM32F405 `TIM2` in `timebase.rs`, which captures the edge, and `sensor.rs` |
//! | convert the sensor's units and issues to the estimator's | [`lsm6dsox::imu`] |
//! | turn the sample and what has arrived into an estimate and an [`Outbox`](exchange::Outbox), with all decisions on the way | [`foot`], a function, with its `estimation` |
//! | put frames into a mailbox at once, or queue them; the newest win | [`ports`]; on the STM32F405 with `can.rs` |
//!
//! The path of a setting, in the order of time. The functions of the foot and of the node stand next to each other:
//!
//! | step | function |
//! |---|---|
//! | a frame or bytes become an [`Input`](exchange::Input), which waits for the next tick | a task of the board, on the STM32F405 `receive_can` or `receive_uart` of `foot.rs`; for bytes [`Ports::put_uart`](ports::Ports::put_uart); [`Ports::put`](ports::Ports::put) |
//! | the foot passes it to the node, after the frames of the tick are sent | `Foot::take_input`, [`Node::receive`](wire::Node::receive) or [`uart_requests`] |
//! | the node checks type, range, state and lock, and changes the setting | `Device::write` of [`wire::node`], by the table in [`wire::dictionary`] |
//! | the foot uses it from the next tick on, if necessary by a new estimator | `Foot::act`, `Estimation::update` |
//! | after `save`, the thread level stores all settings | `Foot::act`, [`tasks::serve_requests`], [`Storage::store`](storage::Storage::store) |
//! | the requester gets the result | `Foot::finish_settings`, [`Node::finish`](wire::Node::finish) |
//! | the next start loads and uses them | `run` of the board, [`Storage::load_at_start`](storage::Storage::load_at_start), [`Foot::new_in`](foot::Foot::new_in) |
//!
//! In parallel:
//!
//! | task | module |
//! |---|---|
//! | store settings, feed the watchdog, drive the LED: work without a deadline | [`tasks`], and the crate [`storage`] |
//! | track faults, liveness, costs and the record of a crash | [`supervision`] |
//! | format the report of the program that measures a new board | [`bring_up`] |
//! | compute with floats on a core without instructions for them | [`float`] |
//!
//! There are three levels. A lower level can delay a higher one only by a critical section (a few µs) or by erasing
//! flash:
//!
//! - **Sampling** owns the sensor and the [`Foot`], and runs at interrupt priority. [`tasks::sample`] calls
//!   [`Foot::tick`](foot::Foot::tick) at each tick, whatever the sensor does, and passes its outbox to [`Ports`].
//! - **Communication** moves bytes between the buses and [`Ports`]. It belongs to the board, because buses differ.
//! - **Thread** stores settings, feeds the watchdog and drives the LED.
//!
//! Ports are queues. Their critical sections are short, and no lock is held across a wait.
//!
//! Interfaces that a board implements, and the tasks that it spawns:
//!
//! | the board provides | for |
//! |---|---|
//! | an `AsyncBus` of the sensor with [`SetBusSpeed`](lsm6dsox::SetBusSpeed), such as an `embedded_hal_async` `SpiDevice`, and a `DelayNs` | [`sampling::Sensor`] |
//! | [`sampling::Ticks`]: a timer and the captured edges | [`tasks::sample`], a task |
//! | [`board::Board`]: load input, watchdog, rates, resets | the tasks of [`tasks`] |
//! | [`ports::Mailboxes`], a task that calls [`Ports::send_can`](ports::Ports::send_can) for queued frames, one that puts received frames into [`Ports::put`](ports::Ports::put) | CAN |
//! | a task that takes [`Ports::take_uart`](ports::Ports::take_uart) to the line, one that puts its bytes with [`Ports::put_uart`](ports::Ports::put_uart) | UART |
//! | an `embedded_storage` `NorFlash` | [`tasks::serve_requests`], a task |
//! | an `embedded_hal` `OutputPin` | [`tasks::blink`], a task |
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

pub mod board;
pub mod bring_up;
pub mod diagnosis;
mod estimation;
pub mod exchange;
pub mod float;
pub mod foot;
pub mod ports;
pub mod sampling;
pub mod supervision;
pub mod tasks;
pub mod uart_requests;

pub use board::Board;
pub use foot::{Crystal, Foot, STORES_AT_ONCE, Start};
pub use ports::Ports;
