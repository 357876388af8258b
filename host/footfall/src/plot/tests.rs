//! Tests of the replay figure by its texts and traces.

use super::*;
use estimator_core::{Gravity, ImuSample, Load, Probabilities, Timestamp};

fn picture(samples: u64, load: Option<Load>, label: Option<Label>) -> String {
    let phases = [Phase::Stance, Phase::Slip, Phase::Swing];
    picture_of_phases(samples, load, label, |k| match load {
        Some(_) => phases[k / 7 % 3],
        None => Phase::Unknown,
    })
}

fn picture_of_phases(
    samples: u64,
    load: Option<Load>,
    label: Option<Label>,
    phase: impl Fn(usize) -> Phase,
) -> String {
    let samples: Vec<_> = (0..samples)
        .map(|k| RecordedSample {
            imu: ImuSample { timestamp: Timestamp::from_micros(k * 1000), ..ImuSample::default() },
            load,
            label,
        })
        .collect();
    let estimates: Vec<_> = (0..samples.len())
        .map(|k| ContactEstimate {
            phase: phase(k),
            probabilities: Probabilities {
                stable: (k % 17) as f32 / 16.0,
                ..Probabilities::default()
            },
            ..ContactEstimate::default()
        })
        .collect();
    let recording = Recording {
        name: "busy walk".to_owned(),
        sample_rate: 1000.0,
        gravity: Gravity::Removed,
        load_title: "vertical force (N)".to_owned(),
        samples,
    };
    svg(&recording, &estimates).unwrap()
}

/// Returns the number of blocks of a colour: one per panel and interval, plus one in the legend.
fn blocks(svg: &str, RGBColor(r, g, b): RGBColor) -> usize {
    svg.matches(&format!("fill=\"#{r:02X}{g:02X}{b:02X}\"")).count()
}

#[test]
fn each_state_has_its_own_shade_and_name() {
    for (phase, name, colour) in [
        (Phase::Swing, "state: swing", SWING_SHADE),
        (Phase::QuietSwing, "state: quiet swing", QUIET_SWING_SHADE),
        (Phase::Slip, "state: slip", SLIP_SHADE),
        (Phase::Unknown, "state: unknown", UNKNOWN_SHADE),
    ] {
        let svg = picture_of_phases(1000, Some(Load(5.0)), None, |k| match k {
            0..300 => phase,
            _ => Phase::Stance,
        });
        assert!(svg.contains(name), "{name}");
        assert_eq!(svg.matches("state: ").count(), 1, "{name}");
        assert_eq!(blocks(&svg, colour), 1 + 4, "{name}");
    }
}

#[test]
fn brief_state_is_not_drawn_as_a_hairline() {
    // At 14 s, a shading column is 29 ms wide.
    let slip_of = |milliseconds: usize| {
        let svg = picture_of_phases(14_000, Some(Load(5.0)), None, |k| match k {
            0..7000 => Phase::Swing,
            _ if k < 7000 + milliseconds => Phase::Slip,
            _ => Phase::Stance,
        });
        blocks(&svg, SLIP_SHADE)
    };
    assert_eq!(slip_of(5), 0);
    assert_eq!(slip_of(50), 1 + 4);
}

#[test]
fn axes_and_legend_name_the_drawn_series() {
    let svg = picture(1000, Some(Load(5.0)), Some(Label::Stable));
    let alone = ["busy walk", "time (s)", "label: stable", "state: swing", "state: slip"];
    for text in alone {
        assert!(svg.contains(text), "{text}");
    }
    for text in ["vertical force (N)", "P tangential", "P vertical", "P stable"] {
        assert_eq!(svg.matches(&format!("\n{text}\n")).count(), 2, "{text}");
    }
}

#[test]
fn unrecorded_series_are_not_drawn() {
    let svg = picture(1000, None, None);
    for text in ["force", "label:", "state:"] {
        assert!(!svg.contains(text), "{text}");
    }
}

#[test]
fn single_sample_can_be_drawn() {
    assert!(picture(1, Some(Load(0.0)), None).contains("</svg>"));
}

#[test]
fn size_stays_below_1_mb_for_any_recording() {
    let svg = picture(300_000, Some(Load(5.0)), Some(Label::Stable));
    assert!(svg.len() < 1_000_000, "{} bytes", svg.len());
}
