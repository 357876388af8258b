//! Tables of the odometry with each detector.

use std::fmt;

use crate::Odometry;
use crate::odometry::calibration::SMALL;
use crate::odometry::{OfDetector, SigmaCalibration, SplitHalf};

use super::cells::{Style, Table, none, write_title, written};

/// Tables of the detectors, of the constants of `sigma_v` chosen on halves, and of the velocities in its units.
#[must_use]
pub fn odometry_tables(odometry: &Odometry, style: Style) -> String {
    written(|to| {
        write_title("Position error by detector", style, to)?;
        detectors(&odometry.detectors).write(style, to)?;
        write_title("Constants chosen on half of the walks", style, to)?;
        halves(&odometry.halves).write(style, to)?;
        write_title("Velocity in units of sigma_v", style, to)?;
        calibration(&odometry.calibration).write(style, to)?;
        fmt::Result::Ok(())
    })
}

fn detectors(detectors: &[OfDetector]) -> Table {
    let row = |of: &OfDetector| {
        vec![
            of.detector.name().to_owned(),
            metres(of.mean_error_m),
            metres(of.largest_error_m),
            of.mean_nis.map_or_else(none, |nis| format!("{nis:.1}")),
        ]
    };
    Table {
        head: head(["detector", "mean error", "largest error", "mean NIS"]),
        rows: detectors.iter().map(row).collect(),
    }
}

fn halves(halves: &[SplitHalf]) -> Table {
    let row = |half: &SplitHalf| {
        vec![
            format!("{} m/s", half.speed_m_s),
            format!("{} m", half.lever_m),
            metres(half.error_m),
            format!("{:.1}", half.nis),
            metres(half.default_error_m),
        ]
    };
    Table {
        head: head([
            "speed",
            "lever",
            "mean error on the other half",
            "mean NIS on it",
            "mean error of the default on it",
        ]),
        rows: halves.iter().map(row).collect(),
    }
}

fn calibration(sets: &[SigmaCalibration]) -> Table {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |of: &SigmaCalibration| {
        vec![
            of.set.name().to_owned(),
            of.mean_square
                .map_or_else(none, |mean| format!("{mean:.1}")),
            percent(of.small_share),
            percent(of.stable_where_small),
        ]
    };
    Table {
        head: head([
            "set",
            "mean v²/σ²",
            &format!("σ ≤ {SMALL} m/s"),
            "of these stable",
        ]),
        rows: sets.iter().map(row).collect(),
    }
}

fn head<const N: usize>(titles: [&str; N]) -> Vec<String> {
    titles.map(str::to_owned).into()
}

fn metres(error: f64) -> String {
    format!("{error:.3} m")
}
