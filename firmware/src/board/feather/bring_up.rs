//! Measures a new Feather.

#![no_std]
#![no_main]

#[expect(dead_code, reason = "the foot's program uses the rest")]
#[path = "../mod.rs"]
mod board;
#[path = "../../bin/bring-up/bus.rs"]
mod bus;
#[path = "../../bin/bring-up/can.rs"]
mod can;
#[path = "../../bin/bring-up/measure.rs"]
mod measure;
#[path = "../../bin/bring-up/supply.rs"]
mod supply;
