//! Faults by name: `NAME`, `NAME:VARIANT`, or `clear`.

use std::str::FromStr;

use crate::emulator::board::BoardOptions;
use crate::product::scenario::{self, Scenario, ScenarioStep};

/// A fault selected by name.
#[derive(Clone, Copy)]
pub struct SelectedFault {
    /// Row of the matrix, or the scenario that clears faults.
    pub scenario: &'static Scenario,
    variant: u64,
}

impl FromStr for SelectedFault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, variant) = match text.split_once(':') {
            Some((name, variant)) => {
                let number = variant.parse::<u64>();
                let number = number.map_err(|_| format!("{variant} is not a number"))?;
                (name, Some(number))
            }
            None => (text, None),
        };
        let scenario = all().find(|scenario| scenario.name == name);
        let scenario = scenario.ok_or_else(|| format!("{name} is not one of {}", names()))?;
        Ok(Self { scenario, variant: variant.unwrap_or(scenario.variants.0) })
    }
}

/// All faults, and `clear`.
fn all() -> impl Iterator<Item = &'static Scenario> {
    scenario::ALL.iter().chain([&scenario::CLEAR])
}

/// Names of all faults, and `clear`.
#[must_use]
pub fn names() -> String {
    let names: Vec<&str> = all().map(|scenario| scenario.name).collect();
    names.join(", ")
}

impl SelectedFault {
    /// Steps of the fault, each with its time from the first, µs.
    #[must_use]
    pub fn steps(&self) -> Vec<(u64, ScenarioStep)> {
        let mut at_us = 0;
        let steps = (self.scenario.steps)(self.variant).into_iter().map(|step| {
            let timed = (at_us, step);
            if let ScenarioStep::Wait(us) = step {
                at_us += u64::from(us);
            }
            timed
        });
        steps.collect()
    }

    /// Returns whether the fault requires a power-up, or a board that was made for it.
    #[must_use]
    pub fn needs_power_up(&self) -> bool {
        let plain = BoardOptions::default();
        let mut options = plain;
        (self.scenario.board)(&mut options, 1_000_000);
        options != plain || self.scenario.at_power_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::board::Injection;

    #[test]
    fn a_fault_has_a_name_and_an_optional_variant() {
        let cut: SelectedFault = "power-cut:17".parse().expect("a fault");
        assert_eq!((cut.scenario.name, cut.variant), ("power-cut", 17));
        let steps: Vec<ScenarioStep> = cut.steps().into_iter().map(|(_, step)| step).collect();
        assert!(steps.contains(&ScenarioStep::Inject(Injection::CutInFlash(17))));
        for text in ["thawed", "power-cut:x", "", "frozen@1"] {
            assert!(text.parse::<SelectedFault>().is_err(), "{text}");
        }
    }

    #[test]
    fn every_row_of_the_matrix_is_a_fault_and_clear_is_one() {
        for name in scenario::ALL.iter().map(|row| row.name).chain(["clear"]) {
            let fault: SelectedFault = name.parse().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(fault.scenario.name, name);
        }
    }

    #[test]
    fn faults_of_board_options_need_a_power_up() {
        let needs = |name: &str| name.parse::<SelectedFault>().expect("a fault").needs_power_up();
        assert!(needs("no-crystal") && needs("no-sensor") && needs("wrong-id"));
        assert!(!needs("miso-low") && !needs("reset") && !needs("clear"));
    }
}
