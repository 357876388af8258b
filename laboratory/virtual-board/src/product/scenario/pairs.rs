//! Two faults at once, or one shortly after the other.

use super::{ALL, Invalid, Pages, Reports, Scenario, ScenarioError, ScenarioOutcome, ScenarioStep};
use crate::emulator::corner::Corner;

/// Delays from the first to the second fault, µs.
pub const DELAYS_US: [u32; 2] = [0, 12_000];

/// Phase of the sampling at which pairs run.
const FIRST_PHASE: u64 = 0;

/// Duration of a contact frame, 39 bytes of 10 bits at 1 Mbit/s, at a tenth of that rate, µs.
const STRETCHED_FRAME_US: u64 = 3_900;

/// Faults of the data-ready line after which samples are read by the timer, whatever edges it carries.
const TIMED: [&str; 2] = ["data-ready-lost", "edges-lost"];

/// Two faults, the second after a delay.
#[derive(Clone, Copy)]
pub struct Pair {
    /// The first fault.
    pub first: &'static Scenario,
    /// The second fault.
    pub second: &'static Scenario,
    /// Delay after the first, µs.
    pub delay_us: u32,
}

/// Returns whether the fault is injected into a running board, without preparation.
fn is_simple(scenario: &&Scenario) -> bool {
    let waits = |step: &ScenarioStep| matches!(step, ScenarioStep::Wait(_));
    let steps = (scenario.steps)(scenario.variants.0);
    !scenario.at_power_up
        && scenario.pages == Pages::Blank
        && scenario.kept.is_none()
        && scenario.before.is_empty()
        && !steps.is_empty()
        && !steps.iter().any(waits)
}

/// Every ordered pair of different faults, with each delay.
pub fn all() -> impl Iterator<Item = Pair> {
    let faults = || ALL.iter().filter(is_simple);
    faults().flat_map(move |first| {
        let others = faults().filter(|second| second.name != first.name);
        others.flat_map(move |second| {
            DELAYS_US.into_iter().map(move |delay_us| Pair { first, second, delay_us })
        })
    })
}

impl Pair {
    /// Name of the pair: both names, and the delay.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{} + {} after {} ms", self.first.name, self.second.name, self.delay_us / 1000)
    }

    /// Period of invalid data: until lasting faults are cleared. Faults that end by themselves are judged after
    /// resets only. While samples are read by the timer, a storm of edges changes none of them.
    fn invalid(&self) -> Invalid {
        let names = [self.first.name, self.second.name];
        let is_timed = TIMED.iter().any(|name| names.contains(name));
        if is_timed && names.contains(&"data-ready-storm") {
            return Invalid::Never;
        }
        match (self.first.invalid, self.second.invalid) {
            (Invalid::UntilCleared, _) | (_, Invalid::UntilCleared) => Invalid::UntilCleared,
            _ => Invalid::Never,
        }
    }

    /// Additional detection time while a debugger halts the core, or for a serial frame that leaves at a tenth of
    /// its rate with the remaining clock, µs.
    const fn standstill_us(&self) -> u64 {
        if self.first.clock_stops || self.second.clock_stops {
            55_000
        } else if self.first.with_can && self.second.with_can {
            0
        } else {
            STRETCHED_FRAME_US
        }
    }

    /// Requirement for both together: no frame reports "stable" on invalid data, and the board recovers. Any report and
    /// any reset is allowed.
    fn scenario(&self) -> Scenario {
        let (first, second) = (self.first, self.second);
        let blind = |scenario: &Scenario, after: u32| match scenario.invalid {
            Invalid::Never => 0,
            _ => u64::from(after) + scenario.blind_us,
        };
        Scenario {
            name: first.name,
            lasts_ms: first.lasts_ms.or(second.lasts_ms),
            invalid: self.invalid(),
            blind_us: blind(first, 0).max(blind(second, self.delay_us)) + self.standstill_us(),
            detected_within_us: u64::MAX,
            phases: 1,
            reports: Reports::Any,
            with_can: first.with_can && second.with_can,
            any_reset: true,
            keeps_time: false,
            clock_stops: first.clock_stops || second.clock_stops,
            clock_beyond_us: 0,
            keeps_new: false,
            may_be_silent: true,
            ..*first
        }
    }

    /// Runs the pair.
    ///
    /// # Errors
    /// As [`Scenario::run`].
    pub fn run(&self, elf: &[u8]) -> Result<ScenarioOutcome, ScenarioError> {
        let mut steps = (self.first.steps)(self.first.variants.0);
        if self.delay_us > 0 {
            steps.push(ScenarioStep::Wait(self.delay_us));
        }
        steps.extend((self.second.steps)(self.second.variants.0));
        self.scenario().run_steps(elf, &steps, FIRST_PHASE, Corner::Typical)
    }
}
