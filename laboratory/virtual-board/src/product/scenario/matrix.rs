//! The fault matrix: runs of all scenarios, and the figures of their outcomes.

use serde_json::{Value, json};

use super::{Case, Scenario, ScenarioOutcome};
use crate::emulator::corner::Corner;
use crate::product::on_all_cores;

/// Runs scenarios in all their variants, on all cores, and returns the worst outcome of each. A run that fails is
/// a violation.
#[must_use]
pub fn matrix(
    elf: &[u8],
    corner: Corner,
    rows: &[&'static Scenario],
) -> Vec<(&'static Scenario, ScenarioOutcome)> {
    let runs: Vec<(usize, Case)> = rows
        .iter()
        .enumerate()
        .flat_map(|(index, scenario)| {
            scenario.all_variants().flat_map(move |variant| {
                (0..scenario.phases).map(move |phase| (index, Case { variant, phase }))
            })
        })
        .collect();
    let outcomes = on_all_cores(&runs, |&(index, case)| rows[index].run(elf, case, corner));
    let mut worst: Vec<Option<ScenarioOutcome>> = vec![None; rows.len()];
    for ((index, case), outcome) in runs.into_iter().zip(outcomes) {
        let name = rows[index].name;
        let mut outcome = outcome.unwrap_or_else(|problem| ScenarioOutcome {
            violations: vec![format!("{name}:{}: {problem}", case.variant)],
            ..ScenarioOutcome::default()
        });
        for text in &mut outcome.violations {
            *text += &format!(" (variant {}, phase {})", case.variant, case.phase);
        }
        worst[index] = Some(match worst[index].take() {
            Some(so_far) => so_far.worst(&outcome),
            None => outcome,
        });
    }
    let rows = rows.iter().copied().zip(worst);
    rows.filter_map(|(scenario, outcome)| Some((scenario, outcome?))).collect()
}

/// Lateness below which it is not reported, µs.
const LATE_US: f64 = 2_000.0;

/// Figures of a row, by their keys in the stored result. Times and large counts have two digits, so that a small change
/// of the program does not change each row.
#[must_use]
pub fn figures(scenario: &Scenario, outcome: &ScenarioOutcome) -> Vec<(&'static str, Value)> {
    let emergency = |fault: &wire::Fault| format!("{:#06X} {}", fault.code(), fault.name());
    let emergencies: Vec<String> = outcome.emergencies.iter().map(emergency).collect();
    let serial_alone = outcome.serial.iter().filter(|fault| !outcome.emergencies.contains(fault));
    let serial_alone: Vec<&str> = serial_alone.map(|fault| fault.name()).collect();
    let counters: Vec<&str> = outcome.counters.iter().map(|counter| counter.name()).collect();
    let resets: Vec<String> = outcome.resets.iter().map(|cause| format!("{cause:?}")).collect();
    let is_late = !outcome.had_invalid_data && outcome.late_us > LATE_US;
    let last_stable_us = outcome.last_stable_us.filter(|_| outcome.had_invalid_data);
    let [old, new, other] = outcome.kept;
    let settings = scenario.kept.map(|_| json!({"old": old, "new": new, "other": other}));
    // The report that a fault was cleared counts as recovery only if no frame was disturbed.
    let cleared_us = outcome.cleared_us.filter(|_| outcome.recovered_us.is_none());
    vec![
        ("fault", scenario.name.into()),
        ("description", scenario.what.into()),
        ("detected_ms", outcome.detected_us().map(milliseconds).into()),
        ("resets", resets.into()),
        ("emergencies", emergencies.into()),
        ("faults_over_serial_line_alone", serial_alone.into()),
        ("counters", counters.into()),
        ("boot_up_message", outcome.boot_up.into()),
        ("invalid_data", outcome.had_invalid_data.into()),
        ("last_stable_ms", last_stable_us.map(milliseconds).into()),
        ("late_ms", is_late.then(|| milliseconds(outcome.late_us)).into()),
        ("frames_on_invalid_data", round(outcome.checked).into()),
        ("stable_on_invalid_data", outcome.stable_while_invalid.into()),
        ("recovered_ms", outcome.recovered_us.map(milliseconds).into()),
        ("reported_cleared_ms", cleared_us.map(milliseconds).into()),
        ("healthy_at_end", outcome.healthy.into()),
        ("settings", settings.into()),
        ("note", scenario.note.into()),
    ]
}

/// Rounds a count to two digits.
fn round(count: u64) -> u64 {
    let step = 10_u64.pow(count.max(1).ilog10().saturating_sub(1));
    count / step * step
}

/// Converts a time to ms, with two digits.
fn milliseconds(us: f64) -> f64 {
    let ms = us / 1000.0;
    let (decimals, unit) = match ms {
        ..9.95 => (1, 1.0),
        ..995.0 => (0, 1.0),
        _ => (1, 1000.0),
    };
    let text = format!("{:.decimals$}", ms / unit);
    // A formatted number is a number.
    let rounded = text.parse::<f64>().unwrap_or(f64::NAN);
    (rounded * unit * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_two_digits() {
        let times = [49.0, 9_949.0, 9_951.0, 994_000.0, 995_001.0, 1_234_000.0].map(milliseconds);
        assert_eq!(times, [0.0, 9.9, 10.0, 994.0, 1000.0, 1200.0]);
        assert_eq!([0, 7, 96, 470, 2387].map(round), [0, 7, 96, 470, 2300]);
    }
}
