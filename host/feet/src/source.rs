//! Sources of lines, with their syntax, which is the same in every command.
//!
//! | written | is |
//! |---|---|
//! | `uart:/dev/ttyACM0`, `uart:COM3@115200` | a serial port, at 1 000 000 Bd unless another rate is given |
//! | `can:can0` | an interface of `SocketCAN` |
//! | `slcan:/dev/ttyACM0`, `slcan:/dev/ttyACM0@500` | an adapter that speaks slcan, at 1000 kbit/s unless another rate is given |
//! | `file:can.log`, `file:uart.bin@10`, `file:walk.mcap@max` | a log, a recording of the serial line or of an IMU, at its own speed unless another is given |

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use config::Resolved;
use options::{ContactUse, InputOptions};
use thiserror::Error;

/// Default rate of a foot's serial port, Bd.
pub const DEFAULT_BAUD: u32 = 1_000_000;

/// Default rate of a CAN bus, kbit/s.
pub const DEFAULT_KBIT: u32 = 1000;

/// Source of live or recorded data from feet.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A serial port.
    Uart {
        /// Name of the port.
        port: String,
        /// Rate of the line, Bd.
        baud: u32,
    },
    /// An interface of `SocketCAN`.
    Can {
        /// Name of the interface.
        interface: String,
    },
    /// An adapter that speaks slcan.
    Slcan {
        /// The name of its serial port.
        port: String,
        /// The rate of the bus, kbit/s.
        kbit: u32,
    },
    /// A file that is played.
    File {
        /// Path of the file.
        path: PathBuf,
        /// Playback speed; `None` for the original one.
        speed: Option<Speed>,
        /// How the recording of an IMU is read and estimated.
        playback: Box<Playback>,
    },
}

/// Playback speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// A multiple of the original speed.
    Times(f64),
    /// As fast as possible.
    Max,
}

impl Speed {
    /// Original speed.
    pub const REAL: Self = Self::Times(1.0);

    /// Description of the expected text, for errors.
    pub const EXPECTED: &'static str = "a number from 0.001, or max,";

    /// Minimum multiple: one second takes 1000 s.
    const SLOWEST: f64 = 0.001;

    /// Creates a multiple of the original speed; `None` if it is below 0.001 or not finite.
    #[must_use]
    pub fn new(times: f64) -> Option<Self> {
        (times >= Self::SLOWEST && times.is_finite()).then_some(Self::Times(times))
    }
}

impl FromStr for Speed {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "max" => Ok(Self::Max),
            _ => text.parse().ok().and_then(Self::new).ok_or(()),
        }
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(times) => write!(f, "{times}"),
            Self::Max => f.write_str("max"),
        }
    }
}

/// How a recording of an IMU is read for playback, and the settings of its estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    /// Properties of the file beyond its format.
    pub input_options: InputOptions,
    /// Preset, configuration and options.
    pub settings: Resolved,
    /// Names of the given options that change an estimate and nothing else.
    pub estimator_options: Vec<&'static str>,
}

impl Default for Playback {
    /// Uses the contacts that a bag has of its feet as the estimates.
    fn default() -> Self {
        Self {
            input_options: InputOptions {
                contacts: ContactUse::Recorded,
                ..InputOptions::default()
            },
            settings: Resolved::default(),
            estimator_options: Vec::new(),
        }
    }
}

/// Error in the text of a source.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SourceError {
    /// The kind of source is unknown.
    #[error(
        "{0:?} is not a source; sources are uart:PORT[@BAUD], can:INTERFACE, slcan:PORT[@KBIT] and file:PATH[@SPEED]"
    )]
    Unknown(String),
    /// The part after the kind is missing.
    #[error("{source_text:?} lacks {lacking}, as in {example}")]
    Lacks {
        /// The text.
        source_text: String,
        /// Missing part.
        lacking: &'static str,
        /// Valid example.
        example: &'static str,
    },
    /// The number after `@` is invalid.
    #[error(transparent)]
    Value(#[from] InvalidValue),
}

/// Value in the text of a source that is not accepted.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{key} is {value:?}, but {expected} is expected")]
pub struct InvalidValue {
    /// Name of the value.
    pub key: &'static str,
    /// Text of the value.
    pub value: String,
    /// Expected values.
    pub expected: &'static str,
}

/// Rates of CAN buses that an slcan adapter knows, kbit/s, in the order of its commands `S0` to `S8`.
pub const SLCAN_RATES_KBIT: [u32; 9] = [10, 20, 50, 100, 125, 250, 500, 800, 1000];

impl FromStr for Source {
    type Err = SourceError;

    fn from_str(text: &str) -> Result<Self, SourceError> {
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let lacks = |lacking, example| SourceError::Lacks {
            source_text: text.to_owned(),
            lacking,
            example,
        };
        // The rate comes after the last @, if there is one.
        let split = rest.rsplit_once('@');
        let (port, rate) = split.map_or((rest, None), |(port, rate)| (port, Some(rate)));
        match kind {
            "uart" if port.is_empty() => Err(lacks("a port", "uart:/dev/ttyACM0")),
            "uart" => {
                let baud = rate.map(|rate| {
                    let key = "the rate of the serial port";
                    parse_value(rate, key, "a rate in Bd", |baud| *baud != 0)
                });
                Ok(Self::Uart { port: port.to_owned(), baud: baud.unwrap_or(Ok(DEFAULT_BAUD))? })
            }
            "can" if rest.is_empty() => Err(lacks("an interface", "can:can0")),
            "can" => Ok(Self::Can { interface: rest.to_owned() }),
            "slcan" if port.is_empty() => Err(lacks("a port", "slcan:/dev/ttyACM0")),
            "slcan" => {
                const EXPECTED: &str =
                    "10, 20, 50, 100, 125, 250, 500, 800 or 1000 kbit/s, as slcan knows them,";
                let is_known = |kbit: &u32| SLCAN_RATES_KBIT.contains(kbit);
                let kbit =
                    rate.map(|rate| parse_value(rate, "the rate of the bus", EXPECTED, is_known));
                Ok(Self::Slcan { port: port.to_owned(), kbit: kbit.unwrap_or(Ok(DEFAULT_KBIT))? })
            }
            "file" => {
                // A name may contain an @: the part after the last one is a speed only if it parses as one.
                let (path, speed) = match split.map(|(path, speed)| (path, speed.parse())) {
                    Some((path, Ok(speed))) => (path, Some(speed)),
                    _ => (rest, None),
                };
                if path.is_empty() {
                    return Err(lacks("a file", "file:can.log"));
                }
                Ok(Self::File { path: path.into(), speed, playback: Box::default() })
            }
            _ => Err(SourceError::Unknown(text.to_owned())),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uart { port, baud } => write!(f, "uart:{port}@{baud}"),
            Self::Can { interface } => write!(f, "can:{interface}"),
            Self::Slcan { port, kbit } => write!(f, "slcan:{port}@{kbit}"),
            Self::File { path, speed, .. } => {
                write!(f, "file:{}", path.display())?;
                speed.map_or(Ok(()), |speed| write!(f, "@{speed}"))
            }
        }
    }
}

impl Source {
    /// Path of the file that is played, if the source is a file.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File { path, .. } => Some(path),
            _ => None,
        }
    }

    /// Sets how a recording of an IMU is read and estimated. Has no effect on other sources.
    #[must_use]
    pub fn played_with(mut self, other: Playback) -> Self {
        if let Self::File { playback, .. } = &mut self {
            **playback = other;
        }
        self
    }

    /// Sets the speed of a file if its text has none.
    #[must_use]
    pub fn at_speed(mut self, other: Speed) -> Self {
        if let Self::File { speed, .. } = &mut self {
            speed.get_or_insert(other);
        }
        self
    }
}

/// Parses a value in the text of a source, and checks its range.
///
/// # Errors
/// The text is not a `T`, or is out of range. `expected` describes the range.
pub fn parse_value<T: FromStr>(
    text: &str,
    key: &'static str,
    expected: &'static str,
    is_valid: impl Fn(&T) -> bool,
) -> Result<T, InvalidValue> {
    let value = text.parse().ok().filter(is_valid);
    value.ok_or_else(|| InvalidValue { key, value: text.to_owned(), expected })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Source {
        text.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    fn error(text: &str) -> String {
        text.parse::<Source>().expect_err(text).to_string()
    }

    #[test]
    fn documented_sources_are_parsed() {
        let uart = |port: &str, baud| Source::Uart { port: port.to_owned(), baud };
        assert_eq!(source("uart:/dev/ttyACM0"), uart("/dev/ttyACM0", 1_000_000));
        assert_eq!(source("uart:COM3@115200"), uart("COM3", 115_200));
        assert_eq!(source("can:can0"), Source::Can { interface: "can0".to_owned() });
        let slcan = |kbit| Source::Slcan { port: "/dev/ttyACM1".to_owned(), kbit };
        assert_eq!(source("slcan:/dev/ttyACM1"), slcan(1000));
        assert_eq!(source("slcan:/dev/ttyACM1@500"), slcan(500));
        let file =
            |path: &str, speed| Source::File { path: path.into(), speed, playback: Box::default() };
        assert_eq!(source("file:can.log"), file("can.log", None));
        assert_eq!(source("file:a@home.log"), file("a@home.log", None));
        let tenfold = Speed::new(10.0);
        assert_eq!(source("file:a@home.log@10"), file("a@home.log", tenfold));
        assert_eq!(source("file:x.mcap@max"), file("x.mcap", Some(Speed::Max)));
    }

    #[test]
    fn default_rates_match_the_settings_of_a_foot() {
        let settings = wire::Settings::default();
        assert_eq!(DEFAULT_BAUD, settings.uart_rate());
        assert_eq!(DEFAULT_KBIT * 1000, settings.can_bit_rate());
    }

    #[test]
    fn invalid_source_error_names_the_expected_form() {
        assert_eq!(
            error("/dev/ttyACM0"),
            "\"/dev/ttyACM0\" is not a source; sources are uart:PORT[@BAUD], can:INTERFACE, slcan:PORT[@KBIT] and file:PATH[@SPEED]"
        );
        assert_eq!(error("uart:"), "\"uart:\" lacks a port, as in uart:/dev/ttyACM0");
        assert_eq!(
            error("uart:COM3@fast"),
            "the rate of the serial port is \"fast\", but a rate in Bd is expected"
        );
        assert!(error("slcan:x@33").contains("as slcan knows them"));
        assert!(error("uart:/dev/ttyACM0@0").contains("a rate in Bd"));
    }

    #[test]
    fn default_speed_applies_to_files_without_a_speed() {
        let played = source("file:x@2").at_speed(Speed::Max);
        assert_eq!(played, source("file:x@2"));
        assert_eq!(source("file:x").at_speed(Speed::Max), source("file:x@max"));
        assert_eq!(source("can:x").at_speed(Speed::Max), source("can:x"));
    }
}
