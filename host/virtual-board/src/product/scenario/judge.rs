//! The requirements on every scenario, independent of its row in the table.

use super::{Invalid, Reports, Scenario, ScenarioOutcome};

/// The requirements that an outcome violates; empty if it meets all.
#[must_use]
pub fn violations(scenario: &Scenario, outcome: &ScenarioOutcome) -> Vec<String> {
    let mut all = Vec::new();
    let mut refuse_if = |wrong: bool, text: String| {
        if wrong {
            all.push(format!("{}: {text}", scenario.name));
        }
    };
    refuse_if(
        outcome.stable_while_invalid > 0,
        format!("{} frames said stable on invalid data", outcome.stable_while_invalid),
    );
    refuse_if(
        outcome.late_us > Invalid::MAX_LATE_MS as f64 * 1000.0,
        format!("a frame said stable {} µs late", outcome.late_us),
    );
    refuse_if(
        outcome.detected_us() > Some(scenario.detected_within_us as f64),
        format!("detected after {:?} µs", outcome.detected_us()),
    );
    refuse_if(
        !outcome.has_reported(scenario.reports),
        format!("{:?} was not reported", scenario.reports),
    );
    let was_silent = outcome.silent_us.iter().all(|&silent| silent >= outcome.invalid_us);
    refuse_if(
        scenario.invalid != Invalid::Never
            && outcome.checked == 0
            && !(scenario.may_be_silent && was_silent),
        "no frame was checked".into(),
    );
    refuse_if(
        !scenario.any_reset && outcome.resets != scenario.resets,
        format!("resets: {:?}", outcome.resets),
    );
    refuse_if(
        outcome.healthy == scenario.stays(),
        format!("recovered afterwards: {}", outcome.healthy),
    );
    refuse_if(outcome.kept[2] > 0, format!("settings old, new, other: {:?}", outcome.kept));
    let refused = outcome.has_reported(Reports::Fault(wire::Fault::ConfigStore));
    refuse_if(
        scenario.keeps_new && !refused && outcome.kept[1] == 0,
        "settings are not those that were stored, and no fault was reported".into(),
    );
    refuse_if(
        !outcome.steady_clock && scenario.keeps_time,
        "a sample's time is not a tick after the one before".into(),
    );
    refuse_if(
        outcome.last_sample_us < scenario.clock_beyond_us,
        format!("the clock came to {} µs", outcome.last_sample_us),
    );
    all
}
