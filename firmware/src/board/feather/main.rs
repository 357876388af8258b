//! The foot's program on the Feather.

#![no_std]
#![no_main]

#[path = "../mod.rs"]
mod board;
#[path = "../../program/mod.rs"]
mod program;
