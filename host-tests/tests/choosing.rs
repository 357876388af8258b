//! Why the default preset is as it is: what each part of it earns, and how much hangs on each number.
//!
//! The settings were to be chosen on two recordings of ATLAS and on the simulated foot; both tables
//! say which recordings those are, and `docs/choosing.md`, which holds the tables, how far that was
//! kept. A change of any result shows.

use estimator_core::{Calibrator, Params, Residual, SlideParams, WindowLength};
use footfall::gait::Simulation;
use footfall::input::{self, Format, Hints};
use footfall::metrics::Scored;
use footfall::recording::{Label, Recording};
use footfall::reliability::calibration_error;
use footfall::replay::replay;
use host_tests::committed::assert_block;
use host_tests::datasets::recorded;
use host_tests::slips::{Score, profiles};

const DOCUMENT: &str = "docs/choosing.md";

/// The first two chose. The third was not to, but was in view.
const ATLAS: [&str; 3] = [
    "pce/ATLAS_01ground.csv",
    "pce/ATLAS_01ground_3steps.csv",
    "pce/ATLAS_01ground_003slip.csv",
];

/// Were not to choose, but were in view.
const LCD: [&str; 2] = ["lcd/ATLAS_7k_04ground.csv", "lcd/NAO_05ground.csv"];

/// Pooled over [`ATLAS`], the default preset as it is.
const POOLED_RMSE: f64 = 0.270;

/// Every so many profiles of the grid of slips are walked. It has no divisor with any side of the
/// grid in common, so all values of each occur.
const PROFILE_STEP: usize = 7;

/// Duration of the paper's window at 1 kHz.
const PAPER_WINDOW: WindowLength = WindowLength::Duration(0.05);

/// The default preset without what it adds to the paper's method; kernels and half-widths stay.
const ONE_WINDOW: Params = Params {
    short_window: None,
    slide: None,
    residual: Residual::Kept,
    tolerance: 0.0,
    ..Params::DEFAULT
};

struct Data {
    atlas: Vec<Recording>,
    lcd: Vec<Recording>,
    walks: Vec<Simulation>,
}

/// `None` where a recording is absent.
fn data() -> Option<Data> {
    let read = |file, format| {
        let loaded = input::read(&recorded(file)?, format, &Hints::default());
        Some(loaded.expect("a readable file").recording)
    };
    let atlas = ATLAS.map(|file| read(file, Format::PceAtlas));
    let lcd = LCD.map(|file| read(file, Format::Lcd));
    let walks = (2000..).zip(profiles().step_by(PROFILE_STEP));
    Some(Data {
        atlas: atlas.into_iter().collect::<Option<_>>()?,
        lcd: lcd.into_iter().collect::<Option<_>>()?,
        walks: walks
            .map(|(seed, profile)| profile.simulate(14.0, seed))
            .collect(),
    })
}

fn scored(recording: &Recording, params: &Params) -> Vec<Scored> {
    let estimates = replay(recording, params).expect("valid parameters");
    Scored::collect(&recording.samples, &estimates)
}

fn rmse(scored: &[Scored]) -> f64 {
    let squared_error = |sample: &Scored| {
        let label = match sample.label {
            Label::Stable => 1.0,
            Label::NotStable => 0.0,
        };
        (sample.probability - label) * (sample.probability - label)
    };
    let sum: f64 = scored.iter().map(squared_error).sum();
    libm::sqrt(sum / scored.len() as f64)
}

/// `params` with the half-widths of a robot that has walked `recording`, found without its labels.
fn calibrated(recording: &Recording, params: &Params) -> Params {
    let params = Params {
        sample_rate: recording.sample_rate,
        ..*params
    };
    let mut calibrator = Calibrator::new(&params);
    for estimate in replay(recording, &params).expect("valid parameters") {
        calibrator.update(&estimate);
    }
    Params {
        half_width: calibrator.propose().expect("enough steps"),
        ..params
    }
}

/// What settings score on the simulated foot, as cells.
fn walked(walks: &[Simulation], params: &Params) -> String {
    let mut score = Score::default();
    walks.iter().for_each(|walk| score.add(walk, params));
    let milliseconds = |seconds: f64| match seconds.is_finite() {
        true => format!("{:.0}", 1e3 * seconds),
        false => "never".to_owned(),
    };
    format!(
        "{} | {} | {:.2} | {} | {:.1} |",
        milliseconds(score.onset(0.5)),
        milliseconds(score.latency(0.5)),
        1e3 * score.displacement().0,
        score.missed(),
        score.false_per_thousand(),
    )
}

const WALKED_TITLES: &str =
    "rest found, ms | slip found, ms | slid by then, mm | slips not found | false in 1000 |";

#[test]
fn each_part_of_the_default_preset_earns_its_place() {
    let Some(data) = data() else {
        return;
    };
    let short = Params {
        short_window: Params::DEFAULT.short_window,
        ..ONE_WINDOW
    };
    let residual = Params {
        residual: Residual::Removed,
        ..short
    };
    let slide = Params {
        slide: Params::DEFAULT.slide,
        ..residual
    };
    let paper = Params {
        window: PAPER_WINDOW,
        ..Params::PAPER
    };
    let rows = [
        ("paper preset (its window as 50 ms)", paper),
        ("one window, default kernels", ONE_WINDOW),
        ("+ `short_window`", short),
        ("+ `residual`", residual),
        ("+ `slide`", slide),
        ("+ `tolerance` = **default preset**", Params::DEFAULT),
    ];
    let mut table = format!(
        "| | 01ground, chose | 3steps, chose | 003slip | pooled | its calibration error | ATLAS_7k | NAO | {WALKED_TITLES}\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n"
    );
    let mut pooled = Vec::new();
    for (name, params) in rows {
        let atlas: Vec<Vec<Scored>> = data
            .atlas
            .iter()
            .map(|recording| scored(recording, &params))
            .collect();
        let lcd: Vec<f64> = data
            .lcd
            .iter()
            .map(|recording| match name.starts_with("paper") {
                true => rmse(&scored(recording, &params)),
                false => {
                    let params = calibrated(recording, &params);
                    rmse(&scored(recording, &params))
                }
            })
            .collect();
        pooled.push((rmse(&atlas.concat()), lcd.clone()));
        let [one, two, three] = [0, 1, 2].map(|file| rmse(&atlas[file]));
        // The paper preset is for samples without gravity; on the foot it is "one window".
        let walked = match name.starts_with("paper") {
            true => "| | | | |".to_owned(),
            false => walked(&data.walks, &params),
        };
        table += &format!(
            "| {name} | {one:.4} | {two:.4} | {three:.4} | {:.4} | {:.3} | {:.4} | {:.4} | {walked}\n",
            rmse(&atlas.concat()),
            calibration_error(&atlas.concat()).expect("samples"),
            lcd[0],
            lcd[1],
        );
    }
    assert_block(DOCUMENT, "parts", &table);
    let (paper, default) = (&pooled[0], &pooled[pooled.len() - 1]);
    assert!(default.0 <= POOLED_RMSE, "{}", default.0);
    for (paper, default) in paper.1.iter().zip(&default.1) {
        assert!(default < paper, "LCD: {default} against {paper}");
    }
}

#[test]
fn the_sensitivity_to_each_number_is_the_one_that_was_written_down() {
    let Some(data) = data() else {
        return;
    };
    let default = Params::DEFAULT;
    let mut settings: Vec<(String, Params)> = Vec::new();
    for window in [25.0_f32, 50.0, 100.0] {
        for width in [0.5_f32, 1.0, 2.0] {
            for tolerance in [0.0_f32, 0.3, 0.4, 0.5] {
                let params = Params {
                    window: WindowLength::Duration(1e-3 * window),
                    half_width: default.half_width.map(|v| v * width),
                    tolerance,
                    ..default
                };
                let name = format!("window {window} ms, δ × {width}, tolerance {tolerance:.2}");
                settings.push((name, params));
            }
        }
    }
    for factor in [0.25_f32, 4.0, 10.0] {
        let bandwidth = default.bandwidth.map(|h| h * factor);
        settings.push((
            format!("h × {factor}"),
            Params {
                bandwidth,
                ..default
            },
        ));
    }
    for short in [0.0_f32, 5.0, 20.0] {
        let window = WindowLength::Duration(1e-3 * short);
        let short_window = (short > 0.0).then_some(window);
        let params = Params {
            short_window,
            ..default
        };
        settings.push((format!("short window {short} ms"), params));
    }
    for (speed, time_constant) in [(2.5_f32, 70.0_f32), (10.0, 70.0), (5.0, 35.0), (5.0, 140.0)] {
        let slide = Some(SlideParams {
            speed: 1e-3 * speed,
            time_constant: 1e-3 * time_constant,
        });
        let name = format!("slide {speed} mm/s over {time_constant} ms");
        settings.push((name, Params { slide, ..default }));
    }
    let mut table = format!(
        "| | 01ground, chose | 3steps, chose | 003slip | pooled | {WALKED_TITLES}\n\
         |---|---|---|---|---|---|---|---|---|---|\n"
    );
    for (name, params) in settings {
        let atlas: Vec<Vec<Scored>> = data
            .atlas
            .iter()
            .map(|recording| scored(recording, &params))
            .collect();
        let [one, two, three] = [0, 1, 2].map(|file| rmse(&atlas[file]));
        let name = match params == default {
            true => format!("**{name}**"),
            false => name,
        };
        table += &format!(
            "| {name} | {one:.3} | {two:.3} | {three:.3} | {:.3} | {}\n",
            rmse(&atlas.concat()),
            walked(&data.walks, &params)
        );
    }
    assert_block(DOCUMENT, "sensitivity", &table);
}
