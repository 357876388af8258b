//! The foot's program on the reference board.

#![no_std]
#![no_main]

mod board;
mod program;
