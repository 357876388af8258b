//! Acceptance of a board by a person with a foot in the hand: the steps, the quantities measured in each, and their limits.
//!
//! | item | file |
//! |---|---|
//! | quantities with limits, their sources and remedies; measured figures | [`figure`] |
//! | contacts and motions of one foot, over CAN and over the serial line; rest, from motions | `motion` |
//! | board and sensor, without hands | `board` |
//! | a foot that lies still | `still` |
//! | six sides, and the turns between them | `turns` |
//! | taps, steps, loads, and a sensor that is unplugged | `contacts` |

mod board;
mod contacts;
pub mod figure;
mod motion;
mod still;
mod turns;

use std::time::Duration;

use estimator_core::Vec3;
use estimator_core::mounting::Mounting;
use thiserror::Error;
use wire::dictionary::index;
use wire::{Address, Value};

use super::self_test::SelfTestError;
use super::settings::{self, Lasting, SettingValues, SettingsError};
use super::{Client, RequestError};
use crate::remedy::FootHint;
pub use figure::{Figure, FigureHint, FigureOutcome, LimitedQuantity, Verdict};
use motion::{Moment, MotionSource, RestDetector, watch};

/// Error that ends the acceptance.
#[derive(Debug, Error)]
pub enum AcceptError {
    /// The line does not work.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The raw samples of a serial line could not be switched on or off.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The setting of the self-test could not be put back.
    #[error(transparent)]
    SelfTest(SelfTestError),
}

impl AcceptError {
    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::Request(error) => error.hint(),
            Self::Settings(error) => error.hint(),
            Self::SelfTest(error) => error.hint(),
        }
    }
}

samples::named! {
    /// A step of the acceptance, in the order in which they are done.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum AcceptStep {
        /// Faults, supply and temperature, as the board reports them.
        Board = "board",
        /// Self-test of the sensor, which resets the board.
        SelfTest = "self-test",
        /// The foot lies still.
        Still = "still",
        /// The foot is put on each of its six sides.
        Sides = "sides",
        /// The sole is tapped.
        Taps = "taps",
        /// The foot takes steps.
        Steps = "steps",
        /// The foot is loaded and unloaded.
        Load = "load",
        /// The sensor is unplugged and plugged in again.
        Unplug = "unplug",
    }
}

impl AcceptStep {
    /// Quantities measured in this step.
    pub fn limits(self) -> impl Iterator<Item = &'static LimitedQuantity> {
        let all = figure::LIMITS.into_iter();
        all.filter(move |limit| limit.step == self)
    }

    /// Returns the figures of this step if there was nothing to measure, with the reason.
    #[must_use]
    pub fn not_tested(self, reason: &str) -> Vec<Figure> {
        let figures = self.limits().map(|limit| limit.not_tested(reason));
        figures.collect()
    }

    /// Returns the figures of this step if the measurement failed, with the reason.
    fn failed(self, reason: &str) -> Vec<Figure> {
        self.limits().map(|limit| limit.failed(reason)).collect()
    }
}

/// Figures of a step.
type StepFigures<E = RequestError> = Result<Vec<Figure>, E>;

/// The person with the foot in the hand.
pub struct Person<'a> {
    /// Longest wait for the person in a step.
    pub patience: Duration,
    /// Shows a text to the person.
    pub tell: &'a mut dyn FnMut(&str),
    /// Returns whether the person has ended the acceptance.
    pub has_left: &'a dyn Fn() -> bool,
}

/// Patience of a person, a function that shows a text, and a function that returns whether the person has left.
type PersonParts<'a> = (Duration, &'a mut dyn FnMut(&str), &'a dyn Fn() -> bool);

impl Person<'_> {
    /// Borrows the parts one by one: texts are shown while the foot is watched.
    fn parts(&mut self) -> PersonParts<'_> {
        (self.patience, &mut *self.tell, self.has_left)
    }
}

/// Measures the foot in these steps, in order.
///
/// The figures of each step are passed to `found` when it ends, unless the person has left during the step. New faults
/// and sensor restarts during a step are additional figures of it. A step fails if the foot stops responding or
/// restarts; the following steps are done nevertheless. On a serial line, raw samples are switched on during the steps.
///
/// # Errors
/// The line does not work, or the foot's settings could not be restored.
pub fn run(
    client: &mut Client,
    steps: &[AcceptStep],
    person: &mut Person,
    found: &mut dyn FnMut(Figure),
) -> Result<(), AcceptError> {
    let mut streams = None;
    let mut known = 0;
    for step in steps {
        if *step > AcceptStep::SelfTest && streams.is_none() {
            // The self-test resets the foot, which would end the streams.
            streams = Some(switch_on_streams(client)?);
        }
        let starts = client.starts();
        let restarts = still::sensor_restarts(client);
        let figures = match step {
            AcceptStep::Board => board::measure(client),
            AcceptStep::SelfTest => match board::test_sensor(client, person) {
                Ok(figures) => Ok(figures),
                Err(SelfTestError::Request(error)) => Err(error),
                Err(error @ SelfTestError::StaysOn(_)) => return Err(AcceptError::SelfTest(error)),
                Err(error) => Ok(step.failed(&error.to_string())),
            },
            AcceptStep::Still => still::measure(client, person),
            AcceptStep::Sides => turns::measure(client, person),
            AcceptStep::Taps => contacts::taps(client, person),
            AcceptStep::Steps => contacts::steps(client, person),
            AcceptStep::Load => contacts::load(client, person),
            AcceptStep::Unplug => contacts::unplug(client, person),
        };
        let figures = figures.and_then(|mut figures| {
            figures.extend(faults_in_step(client, *step, restarts?, &mut known)?);
            Ok(figures)
        });
        let has_restarted = client.starts() != starts && *step != AcceptStep::SelfTest;
        let figures = match figures {
            Ok(_) if has_restarted => step.failed("the foot has restarted: supply, or a crash"),
            Ok(figures) => figures,
            Err(error @ RequestError::Link(_)) => return Err(error.into()),
            Err(error) => step.failed(&error.to_string()),
        };
        if (person.has_left)() {
            break;
        }
        figures.into_iter().for_each(&mut *found);
    }
    if let Some(before) = streams.filter(|before| !before.is_empty()) {
        settings::write(client, &before, Lasting::UntilReset)?;
    }
    Ok(())
}

/// Waits until the foot stands still, and returns the specific force that its sensor reads then, m/s², along the axes of
/// the foot with this mounting; it points up. `None` if the foot has not stood still in the person's patience. On a serial
/// line, raw samples are switched on meanwhile.
///
/// # Errors
/// The line does not work, or the foot's settings could not be put back.
pub fn force_at_rest(
    client: &mut Client,
    mounting: &Mounting,
    person: &mut Person,
) -> Result<Option<Vec3>, AcceptError> {
    let (patience, tell, has_left) = person.parts();
    let streams = switch_on_streams(client)?;
    tell("let the foot stand still");
    let mut rest = RestDetector::default();
    let found = watch(client, has_left, patience, |moment| {
        let Moment::Motion(motion) = moment else {
            return None;
        };
        Some((rest.take(motion)?.force, motion.source))
    });
    if !streams.is_empty() {
        settings::write(client, &streams, Lasting::UntilReset)?;
    }
    Ok(found?.map(|(force, source)| {
        let [x, y, z] = force.to_array().map(|part| part as f32);
        match source {
            MotionSource::Raw => mounting.turn(Vec3::new(x, y, z)),
            MotionSource::Frames => Vec3::new(x, y, z),
        }
    }))
}

/// Returns figures of the faults that are not yet `known`, and of restarts of the sensor.
///
/// Restarts count only in steps with motion, where a sensor that drops out looks like a tap. Nothing counts while the
/// sensor is unplugged, which causes faults, or during the self-test, which restarts it.
fn faults_in_step(
    client: &mut Client,
    step: AcceptStep,
    restarts: u32,
    known: &mut u32,
) -> StepFigures {
    let mut figures = Vec::new();
    if matches!(step, AcceptStep::SelfTest | AcceptStep::Unplug) {
        return Ok(figures);
    }
    let grown = still::sensor_restarts(client)?.wrapping_sub(restarts);
    if grown != 0 && step > AcceptStep::Still {
        figures.push(figure::RESTARTS.measured(f64::from(grown)).with(format!("in {step}")));
    }
    let faults = board::faults(client)?;
    if faults & !*known != 0 && step != AcceptStep::Board {
        figures.push(board::of_faults(faults));
    }
    *known |= faults;
    Ok(figures)
}

/// Switches on the stream of each contact and each raw sample if the foot is on a serial line. Returns the previous values
/// of the changed settings.
fn switch_on_streams(client: &mut Client) -> Result<SettingValues, AcceptError> {
    if client.node().is_some() {
        return Ok(SettingValues::new());
    }
    let wanted = [1, 2].map(|sub| (Address::new(index::UART_STREAMS, sub), Value::U16(1)));
    let changed = settings::write(client, &wanted.into(), Lasting::UntilReset)?;
    let before = changed.into_iter();
    Ok(before.map(|(named, before, _)| (named.address, before)).collect())
}
