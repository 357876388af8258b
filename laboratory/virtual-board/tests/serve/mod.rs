//! `virtual-board serve` as seen by programs: the ELF that is flashed behind a serial port and an slcan adapter,
//! in lock step with the programs, and, where real time or terminals are the subject, in real time.

mod accepting;
mod feet;
mod footfall;
mod python;
mod server;
mod setting_up;
mod updating;
mod wiring;
