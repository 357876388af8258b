//! Faults by name: `NAME`, `NAME:VARIANT`, or `clear`.

use std::str::FromStr;

use crate::emulator::board::{BoardOptions, Injection};
use crate::product::scenario::{self, Pages, Scenario, ScenarioStep};

/// Name that clears all clearable faults.
const CLEAR: &str = "clear";

/// A fault selected by name.
#[derive(Clone, Copy)]
pub struct SelectedFault {
    /// `None` to clear faults.
    scenario: Option<&'static Scenario>,
    variant: u64,
}

impl FromStr for SelectedFault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, variant) = match text.split_once(':') {
            Some((name, variant)) => {
                let number = variant.parse::<u64>();
                let number = number.map_err(|_| format!("{variant} is no number"))?;
                (name, Some(number))
            }
            None => (text, None),
        };
        let scenario = Scenario::named(name);
        if scenario.is_none() && name != CLEAR {
            return Err(format!("{name} is none of {}", names()));
        }
        let first = scenario.map_or(0, |scenario| scenario.variants.0);
        Ok(Self {
            scenario,
            variant: variant.unwrap_or(first),
        })
    }
}

/// Names of all faults, and `clear`.
#[must_use]
pub fn names() -> String {
    let names = scenario::ALL.iter().map(|scenario| scenario.name);
    names.chain([CLEAR]).collect::<Vec<_>>().join(", ")
}

impl SelectedFault {
    /// Row of the matrix; `None` to clear faults.
    #[must_use]
    pub const fn scenario(&self) -> Option<&'static Scenario> {
        self.scenario
    }

    /// Name of the fault; `clear` to clear faults.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.scenario.map_or(CLEAR, |scenario| scenario.name)
    }

    /// Steps that prepare a board for the fault.
    #[must_use]
    pub fn before(&self) -> &'static [ScenarioStep] {
        self.scenario.map_or(&[], |scenario| scenario.before)
    }

    /// Steps of the fault, each with its time from the first, µs.
    #[must_use]
    pub fn steps(&self) -> Vec<(u64, ScenarioStep)> {
        let Some(scenario) = self.scenario else {
            return vec![(0, ScenarioStep::Inject(Injection::Clear))];
        };
        let mut at_us = 0;
        let steps = (scenario.steps)(self.variant).into_iter().map(|step| {
            let timed = (at_us, step);
            if let ScenarioStep::Wait(us) = step {
                at_us += u64::from(us);
            }
            timed
        });
        steps.collect()
    }

    /// Adapts the options of a board for a fault at `at_us`, µs after its power-up.
    pub fn change(&self, options: &mut BoardOptions, at_us: u32) {
        if let Some(scenario) = self.scenario {
            (scenario.board)(options, at_us);
        }
    }

    /// Returns whether the fault requires a power-up, or a board that was made for it.
    #[must_use]
    pub fn needs_power_up(&self) -> bool {
        let plain = BoardOptions::default();
        let mut options = plain;
        self.change(&mut options, 1_000_000);
        options != plain || self.scenario.is_some_and(|scenario| scenario.at_power_up)
    }

    /// Returns whether the fault requires flash pages that are filled before the board is powered up, which takes
    /// minutes of the board's time.
    #[must_use]
    pub fn needs_full_pages(&self) -> bool {
        self.scenario
            .is_some_and(|scenario| scenario.pages != Pages::Blank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_has_a_name_and_an_optional_variant() {
        let cut: SelectedFault = "power-cut:17".parse().expect("a fault");
        assert_eq!((cut.name(), cut.variant), ("power-cut", 17));
        let steps: Vec<ScenarioStep> = cut.steps().into_iter().map(|(_, step)| step).collect();
        assert!(steps.contains(&ScenarioStep::Inject(Injection::CutInFlash(17))));
        for text in ["thawed", "power-cut:x", "", "frozen@1"] {
            assert!(text.parse::<SelectedFault>().is_err(), "{text}");
        }
    }

    #[test]
    fn every_row_of_the_matrix_is_a_fault_and_clear_is_one() {
        for name in scenario::ALL.iter().map(|row| row.name).chain([CLEAR]) {
            let fault: SelectedFault = name.parse().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(fault.name(), name);
        }
    }

    #[test]
    fn faults_of_board_options_need_a_power_up() {
        let needs = |name: &str| {
            name.parse::<SelectedFault>()
                .expect("a fault")
                .needs_power_up()
        };
        assert!(needs("no-crystal") && needs("no-sensor") && needs("wrong-id"));
        assert!(!needs("miso-low") && !needs("reset") && !needs("clear"));
    }
}
