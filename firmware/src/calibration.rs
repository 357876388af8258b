//! Calibration on the foot: a command collects steps, a proposal waits for a second command.
//!
//! The half-widths come from [`estimator_core::calibration`]; here is when it runs. What is
//! proposed changes nothing until it is accepted, which [`wire::Node`] does, by the rules of every
//! other setting.

use estimator_core::calibration::STEPS;
use estimator_core::{Calibrator, ContactEstimate, Params, TooFewSteps};
use wire::node::{Calibration as Command, CalibrationState as State};

/// How long to collect before giving up, ticks.
pub const PATIENCE_TICKS: u32 = 60_000;

/// A calibration, or none.
#[derive(Clone, Debug, Default)]
pub struct Calibration {
    collecting: Option<Collecting>,
    state: State,
}

#[derive(Clone, Debug)]
struct Collecting {
    calibrator: Calibrator,
    ticks: u32,
}

/// Something the foot has to publish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// The state is another one.
    State(State),
    /// There were too few steps.
    Failed(TooFewSteps),
}

impl Calibration {
    /// A command came; the state after it.
    pub fn command(&mut self, command: Command, params: &Params) -> State {
        match command {
            Command::Start => {
                self.collecting = Some(Collecting {
                    calibrator: Calibrator::new(params),
                    ticks: 0,
                });
                self.state = State::Collecting;
            }
            // The proposal is in the settings by now, or nobody wants it.
            Command::Accept | Command::Cancel => *self = Self::default(),
        }
        self.state
    }

    /// One tick.
    pub fn tick(&mut self, estimate: &ContactEstimate) -> Option<News> {
        let Collecting { calibrator, ticks } = self.collecting.as_mut()?;
        calibrator.update(estimate);
        *ticks += 1;
        if calibrator.steps() < STEPS && *ticks < PATIENCE_TICKS {
            return None;
        }
        let result = calibrator.propose();
        self.collecting = None;
        Some(match result {
            Ok(proposal) => {
                self.state = State::Ready(proposal);
                News::State(self.state)
            }
            Err(too_few) => {
                self.state = State::Failed;
                News::Failed(too_few)
            }
        })
    }

    /// How far it is.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }
}
