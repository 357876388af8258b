//! `part MOTION SEED` serves a simulated LSM6DSOX over its standard input and output, for emulators of boards.
//!
//! `MOTION` is `rest`, `rounds` or a gait. A foot stands for a second longer than in its plan. The part is the specimen
//! of `SEED`; at `rest` it is a specimen without error. Time is that of the requests, since power-up, and does not run
//! backwards.
//!
//! A request is an operation, a count, the time in ns as eight bytes, little-endian, and for `w` and `f` as many bytes
//! as counted. A response begins with one byte:
//!
//! | operation | meaning | response |
//! |---|---|---|
//! | `w` | I²C write: a register's address, then values for it and the following ones | 1 if acknowledged, else 0 |
//! | `r` | I²C read of `count` bytes from that address on, or from where the last one ended | 1 if acknowledged, and the bytes |
//! | `e` | INT1 | its level, and the time of the next rising edge in ns; all bits set if there is none |
//! | `f` | fault, by name; `clear` removes all | 1, or 0 if there is no such fault |

use std::env;
use std::error::Error;
use std::io::{self, ErrorKind, Read, Write};

use gait::sensor::felt_by;
use gait::{GaitName, Ground, Plan, SensorParams, Track};
use lsm6dsox::register::{Register, WHO_AM_I};
use lsm6dsox::sim::{Part, PartFault, PartOptions, SharedPart, SimI2c, Stimulus};
use lsm6dsox::{Bus, I2c, Pin, Sa0};

/// Time until the plan begins, s: the program on the board starts meanwhile.
const DELAY_S: f64 = 1.0;

/// Duration of a plan, s; afterwards the foot stays in place.
const PLAN_S: f64 = 7200.0;

/// Temperature of the part, °C.
const TEMPERATURE: f64 = 25.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let motion = arguments.next().ok_or("which motion?")?;
    let seed = arguments.next().ok_or("which seed?")?.parse()?;
    let part = part(&motion, seed)?;
    let mut wires = Wires { bus: I2c::new(part.i2c(), Sa0::Low), address: 0 };
    let (mut input, mut output) = (io::stdin().lock(), io::stdout().lock());
    loop {
        let mut question = [0; 10];
        match input.read_exact(&mut question) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(()),
            result => result?,
        }
        let [operation, count, time @ ..] = question;
        part.advance_to(u64::from_le_bytes(time));
        let mut bytes = vec![0; usize::from(count)];
        if matches!(operation, b'w' | b'f') {
            input.read_exact(&mut bytes)?;
        }
        let answer = match operation {
            b'w' => vec![u8::from(wires.write(&bytes).is_some())],
            b'r' => {
                let acknowledged = wires.read(&mut bytes).is_some();
                [vec![u8::from(acknowledged)], bytes].concat()
            }
            b'e' => {
                let next = part.next_rising_edge_ns(Pin::Int1).unwrap_or(u64::MAX);
                let level = u8::from(part.pin_is_high(Pin::Int1));
                [&[level], next.to_le_bytes().as_slice()].concat()
            }
            b'f' => vec![u8::from(inject(&part, &bytes))],
            _ => return Err(format!("there is no operation {operation}").into()),
        };
        output.write_all(&answer)?;
        output.flush()?;
    }
}

/// The part on its bus, byte by byte.
struct Wires {
    bus: I2c<SimI2c>,
    /// Address of the next byte.
    address: u8,
}

impl Wires {
    /// Writes a register's address, and values from there on; `None` without acknowledge.
    fn write(&mut self, bytes: &[u8]) -> Option<()> {
        let (&address, values) = bytes.split_first()?;
        self.address = address;
        for &value in values {
            self.bus.write(self.address, value).ok()?;
            self.follow();
        }
        // An address alone is acknowledged as any other byte.
        let mut frame = [WHO_AM_I.read_address(), 0];
        self.bus.read(&mut frame).ok()
    }

    /// Reads bytes; `None` without acknowledge.
    fn read(&mut self, bytes: &mut [u8]) -> Option<()> {
        for byte in bytes {
            let mut frame = [self.address | Register::READ, 0];
            self.bus.read(&mut frame).ok()?;
            *byte = frame[1];
            self.follow();
        }
        Some(())
    }

    const fn follow(&mut self) {
        self.address = (self.address + 1) & !Register::READ;
    }
}

fn part(motion: &str, seed: u64) -> Result<SharedPart, Box<dyn Error>> {
    let plan = match motion {
        "rest" => return Ok(Part::new(|_| Stimulus::REST).shared()),
        "rounds" => Plan::rounds(PLAN_S, seed),
        gait => Plan::steady(gait.parse::<GaitName>()?, Ground::Hard, PLAN_S, seed),
    };
    let track = Track::new(&plan);
    let felt = move |seconds: f64| felt_by(&track.at(seconds - DELAY_S), TEMPERATURE);
    let options = PartOptions {
        // The bus takes its time in the emulator.
        byte_time_ns: 0,
        ..SensorParams::LSM6DSOX.specimen(seed)
    };
    Ok(Part::with_options(felt, options).shared())
}

/// Injects the fault of this name; returns whether there is one.
fn inject(part: &SharedPart, name: &[u8]) -> bool {
    let fault = match name {
        b"clear" => {
            part.with(Part::clear_faults);
            return true;
        }
        b"reset" => PartFault::Reset,
        b"low" => PartFault::MisoStuckLow,
        b"high" => PartFault::MisoStuckHigh,
        b"flips" => PartFault::BitFlips { per_million: 1000 },
        b"id" => PartFault::WrongId(0x6B),
        b"no-edges" => PartFault::DataReadyLost,
        b"frozen" => PartFault::FrozenOutput,
        b"saturated" => PartFault::Saturation,
        _ => return false,
    };
    part.inject(fault);
    true
}
