//! The part itself, for hosts: an LSM6DSOX down to its registers.
//!
//! [`Part`] holds registers, clock, signal paths, FIFO and pins; a [`SharedPart`] hands out its
//! ends: a [`SimSpi`] for the drivers, a [`SimI2c`] for others' drivers, a [`SimDelay`] that
//! lets its time pass. What it measures comes from a [`Motion`]. What breaks is a [`Fault`].
//!
//! | what | how near to the part |
//! |---|---|
//! | registers | values after reset, read-only, reserved bits kept; offences against either are counted |
//! | clock | its own, with an error and jitter; all data rates divide 6667 Hz, 25 µs steps of the timestamp come from it too |
//! | filters | point samples of the motion at 6667 Hz, then one second-order Butterworth low-pass at the cut-off set; the accelerometer's ODR/2 at 6667 Hz passes everything; where the cut-off is not known 0.4 ODR |
//! | noise | white before the filter, of the densities in [`noise`](crate::noise) |
//! | range | clipped before the filter at the end of the 16-bit range, and again after |
//! | start | after its data rate is set a gyroscope gives its first sample after 35 ms \[D\], an accelerometer after 5 ms (assumed); filters start settled |
//! | data ready | latched until a high byte is read, or 75 µs long \[D\] |
//! | FIFO | bypass, FIFO and continuous mode; a word is gone once its last byte is read |
//! | reset | 50 µs; after power-up and BOOT nothing answers for 10 ms |
//!
//! Not there: the other register banks, compression, interrupts other than data-ready and
//! watermark, high-pass filters, user offsets.
//!
//! Time is the caller's: nothing happens until [`Part::advance_to`]. The same seed, motion and
//! calls give the same bits on every machine: arithmetic is + − × ÷ and the `libm` crate.

mod batch;
mod bus;
mod channel;
mod clock;
mod fault;
mod filter;
mod handle;
mod memory;
mod motion;
mod part;
mod paths;
mod pins;
mod random;

pub use fault::{Axis, Fault};
pub use handle::{I2cError, SharedPart, SimDelay, SimI2c, SimSpi};
pub use memory::Offence;
pub use motion::{Interpolation, Motion, Recording, RecordingError, Stimulus};
pub use part::{Part, PartOptions};
