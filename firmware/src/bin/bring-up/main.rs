//! Measures a new reference board.

#![no_std]
#![no_main]

#[expect(dead_code, reason = "the foot's program uses the rest")]
#[path = "../../board/mod.rs"]
mod board;
mod bus;
mod can;
mod measure;
mod supply;
