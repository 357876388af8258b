//! Runs of the product on the emulated board.
//!
//! | run | file |
//! |---|---|
//! | faults, their injection, the requirements on the board, pairs of them | [`scenario`], [`fault`] |
//! | all output of a board, its statistics | [`report`]; [`spread`] |
//! | boards in real time behind terminals | `serve` |
//! | comparison with the estimator on the host | [`parity`] |
//! | motion of the sensor, simulated and recorded | [`motion`], [`recorded`] |
//! | runs on all cores | [`cores`] |
//! | additional messages and traffic | [`streams`], [`traffic`] |

pub mod cores;
pub mod fault;
pub mod motion;
pub mod parity;
pub mod recorded;
pub mod report;
pub mod scenario;
#[cfg(unix)]
pub mod serve;
pub mod spread;
pub mod streams;
pub mod traffic;
