//! Simulated LSM6DSOX, for hosts, at the level of its registers.
//!
//! [`Part`] contains registers, clock, signal paths and pins. A [`SharedPart`] provides its interfaces: a [`SimSpi`]
//! for the drivers, a [`SimI2c`] for I²C, and a [`SimDelay`] that advances its time. A [`Motion`] is the source of the
//! measured motion. Faults are [`PartFault`]s.
//!
//! | feature | fidelity |
//! |---|---|
//! | registers | values after reset, read-only, reserved bits kept; violations against either are counted |
//! | clock | its own, with an error and jitter; all data rates divide 6667 Hz |
//! | filters | point samples of the motion at 6667 Hz, then one second-order Butterworth low-pass at the cut-off set; the accelerometer's ODR/2 at 6667 Hz passes everything; an unknown cut-off is 0.4 ODR |
//! | noise | white before the filter, of the densities in [`noise`](crate::noise) |
//! | range | clipped before the filter at the end of the 16-bit range, and again after |
//! | start | by [`StartTimes`]: after its data rate is set a gyroscope gives its first sample after 35 ms \[D\] and is wrong until 70 ms (AN5040, LSM6DSL), an accelerometer gives its first after 5 ms (assumed); filters start settled |
//! | register banks | `FUNC_CFG_ACCESS` switches to two others, which store values without effect |
//! | 3-wire SPI | with `SIM` set no part drives the data line; writes still work |
//! | I3C | INT1 high at power-up, at a reset of the part or of its host leads into it, disabled or not (assumed): the part does not drive the data line; writes still work, and a reset with I3C disabled and INT1 low ends it (STMicroelectronics/stm32-lsm6dso #1, Zephyr #20913) |
//! | SDO | valid some ns after the clock's edge: a clock too fast for it reads each bit one clock late |
//! | data ready | latched until a high byte is read, or 75 µs long \[D\] |
//! | pins | active high or low; INT2's signals on INT1 |
//! | burst reads | `ROUNDING` goes back to the first output |
//! | gyroscope asleep | `SLEEP_G`: as switched off, and it starts as slowly |
//! | `XL_FS_MODE` | the code of ±16 g is ±2 g (not checked against the data sheet) |
//! | reset | 50 µs; after power-up and BOOT nothing answers for up to 10 ms |
//!
//! Not simulated: the function of the other register banks, the FIFO, interrupts other than data-ready, high-pass
//! filters, user offsets, optical stabilisation, external triggers, ultra low power, and open-drain pins. A write that
//! enables one of them is a [violation](Violation::NotSimulated). The timestamp counter is not simulated either, but
//! may be enabled.
//!
//! The caller controls time: nothing happens until [`Part::advance_to`]. The same seed, motion and calls give the same
//! bits on every machine, because arithmetic is + − × ÷ and the `libm` crate.

mod channel;
mod clock;
mod fault;
mod handle;
mod memory;
mod motion;
mod part;
mod random;

pub use fault::{Axis, PartFault};
pub use handle::{I2cError, SharedPart, SimDelay, SimI2c, SimSpi};
pub use memory::Violation;
pub use motion::{Interpolation, Motion, Recording, RecordingError, Stimulus};
pub use part::{Part, PartOptions, StartTimes};
