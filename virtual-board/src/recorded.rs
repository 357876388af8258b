//! Files of recordings become what the sensor feels.
//!
//! A sensor feels gravity. Where a simulator has taken it out, which tells nothing of the tilt, it
//! is put back along z, as on a sole that stays level: what is fed is then the recorded motion of a
//! foot that does not tilt in the field of gravity. Samples are resampled by straight lines to the
//! ticks of the sensor's clock, 6.67 kHz, and reach its codes by its noise, filters and ranges.

use std::path::Path;

use clap::ValueEnum;
use estimator_core::Gravity;
use footfall::gait::sensor::GRAVITY;
use footfall::input::{Format, Hints, Opened};
use lsm6dsox::sim::{Interpolation, Recording, Stimulus};

/// Of the recordings of `lcd`, Hz.
const LCD_RATE: f64 = 100.0;

/// How a file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// A header names the columns, as `footfall replay` reads it
    Csv,
    /// Simulated ATLAS: 13 columns, no header, 1 kHz, gravity removed
    PceAtlas,
    /// Real GO1: force and IMU in g and °/s, no header, 250 Hz
    PceGo1,
    /// Simulated ATLAS and NAO of `lcd`: 13 columns, no header, 100 Hz, gravity removed
    Lcd,
}

/// Reads a file, but for what comes before `skip` seconds.
///
/// # Errors
/// Where it cannot be read, or nothing is left.
pub fn read(path: &Path, layout: Option<Layout>, skip: f64) -> Result<Recording, String> {
    let format = match layout {
        None => None,
        Some(Layout::Csv) => Some(Format::Csv),
        Some(Layout::PceAtlas) => Some(Format::PceAtlas),
        Some(Layout::PceGo1) => Some(Format::PceGo1),
        Some(Layout::Lcd) => return play(LCD_RATE, lcd(path)?, Gravity::Removed, skip),
    };
    let loaded = Opened::new(path, format)
        .and_then(|opened| opened.read(&Hints::default()))
        .map_err(|error| error.to_string())?;
    let recording = loaded.recording;
    let axes = recording.samples.iter().map(|sample| {
        let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        [force.x, force.y, force.z, rate.x, rate.y, rate.z].map(f64::from)
    });
    let rate = f64::from(recording.sample_rate);
    play(rate, axes.collect(), recording.gravity, skip)
}

fn play(rate: f64, axes: Vec<[f64; 6]>, gravity: Gravity, skip: f64) -> Result<Recording, String> {
    let added = match gravity {
        Gravity::Included => 0.0,
        Gravity::Removed => GRAVITY,
    };
    let samples = axes
        .into_iter()
        .skip((skip * rate).max(0.0) as usize)
        .map(|[ax, ay, az, wx, wy, wz]| Stimulus {
            specific_force: [ax, ay, az + added],
            angular_rate: [wx, wy, wz],
            temperature: 25.0,
        })
        .collect();
    Recording::new(rate, samples, Interpolation::Linear).map_err(|error| error.to_string())
}

/// The IMU's columns of a recording of `lcd`: after three forces and three torques.
fn lcd(path: &Path) -> Result<Vec<[f64; 6]>, String> {
    const FIRST: usize = 6;
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let row = |(number, line): (usize, &str)| {
        let cells: Vec<f64> = line
            .split(',')
            .map_while(|cell| cell.trim().parse().ok())
            .collect();
        let axes = cells.get(FIRST..FIRST + 6);
        axes.and_then(|axes| <[f64; 6]>::try_from(axes).ok())
            .ok_or_else(|| format!("{}: line {} is no row of 13", path.display(), number + 1))
    };
    let lines = text.lines().enumerate();
    lines
        .filter(|(_, line)| !line.trim().is_empty())
        .map(row)
        .collect()
}
