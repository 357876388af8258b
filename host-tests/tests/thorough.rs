//! Behaviour of the estimate in many gaits, with many sensors and disturbances, and CAN logs by third-party
//! programs. These tests take minutes of processor time: `.ci/run` runs them.

#[path = "../../wire/tests/python/environment.rs"]
mod environment;

#[path = "attacks/main.rs"]
mod attacks;
mod attitude;
mod broad;
mod calibrate;
mod can_logs;
mod drift;
mod events;
mod feet;
mod findings;
mod hanging;
mod learning;
mod mounting;
mod rates;
mod ringing;
mod robustness;
mod slip;
