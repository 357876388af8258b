//! The fault matrix as a Markdown table, generated from runs.

use super::{Case, Scenario, ScenarioOutcome};
use crate::emulator::corner::Corner;
use crate::product::cores::on_all_cores;

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

/// Lateness below which it is not shown, µs.
const LATE_US: f64 = 2_000.0;

/// The columns.
pub const HEAD: &str = "\
| `fault` | fault | detected after | reported | last \"stable\" after | \"stable\" on invalid data | recovered after |
|---|---|---|---|---|---|---|
";

/// A row of the table.
#[must_use]
pub fn row(scenario: &Scenario, outcome: &ScenarioOutcome) -> String {
    format!(
        "| `{}` | {} | {} | {} | {} | {} | {} |\n",
        scenario.name,
        scenario.what,
        outcome.detected_us().map_or_else(|| "—".into(), time),
        reported(outcome),
        match outcome.last_stable_us {
            _ if !outcome.had_invalid_data && outcome.late_us > LATE_US => {
                format!("data valid, at most {} late", time(outcome.late_us))
            }
            _ if !outcome.had_invalid_data => "data valid".into(),
            None => "never".into(),
            Some(us) => time(us),
        },
        match outcome.checked {
            0 => "—".into(),
            checked => format!("{} of about {}", outcome.stable_while_invalid, round(checked)),
        },
        recovered(scenario, outcome),
    )
}

fn reported(outcome: &ScenarioOutcome) -> String {
    let resets = outcome.resets.iter();
    let mut all: Vec<String> = resets.map(|cause| format!("reset ({cause:?})")).collect();
    let emergency = |fault: &wire::Fault| format!("EMCY {:#06X} {}", fault.code(), fault.name());
    all.extend(outcome.emergencies.iter().map(emergency));
    let serial_only = |fault: &&wire::Fault| !outcome.emergencies.contains(fault);
    let serial = outcome.serial.iter().filter(serial_only);
    all.extend(serial.map(|fault| format!("serial line: {}", fault.name())));
    if !outcome.counters.is_empty() {
        let names: Vec<&str> = outcome.counters.iter().map(|c| c.name()).collect();
        all.push(format!("counted: {}", names.join(", ")));
    }
    if outcome.boot_up {
        all.push("boot-up message".into());
    }
    match all.is_empty() {
        true => "—".into(),
        false => all.join("; "),
    }
}

fn recovered(scenario: &Scenario, outcome: &ScenarioOutcome) -> String {
    let mut text = match (outcome.recovered_us, outcome.cleared_us) {
        (Some(us), _) => time(us),
        (None, Some(us)) => format!("reported cleared after {}", time(us)),
        (None, None) if outcome.healthy => "not disturbed".into(),
        (None, None) => "persists, reported".into(),
    };
    let [old, new, neither] = outcome.kept;
    if scenario.kept.is_some() {
        text += &format!("; settings: {old} × old, {new} × new, {neither} × other");
    }
    if !scenario.note.is_empty() {
        text += "; ";
        text += scenario.note;
    }
    text
}

/// Rounds a count to two digits.
fn round(count: u64) -> u64 {
    let step = 10_u64.pow(count.max(1).ilog10().saturating_sub(1));
    count / step * step
}

/// Formats a time with two digits.
fn time(us: f64) -> String {
    let ms = us / 1000.0;
    match ms {
        ..9.95 => format!("{ms:.1} ms"),
        ..995.0 => format!("{ms:.0} ms"),
        _ => format!("{:.1} s", ms / 1000.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits() {
        let times = [49.0, 9_949.0, 9_951.0, 994_000.0, 995_001.0, 1_234_000.0].map(time);
        assert_eq!(times, ["0.0 ms", "9.9 ms", "10 ms", "994 ms", "1.0 s", "1.2 s"]);
        assert_eq!([0, 7, 96, 470, 2387].map(round), [0, 7, 96, 470, 2300]);
    }
}
