//! `footfall foot … calibrate`: stores the learnt stillness and motion of the foot in non-volatile memory.

use std::time::Duration;

use feet::foot::{Client, Named, calibration};
use serde_json::{Map, Value as Json, json};
use wire::dictionary::index;
use wire::node::{Calibration, CalibrationState};

use super::{FootArguments, to_json};
use crate::files::finish_when_interrupted;
use crate::foot_error::FootError;
use crate::messages;

/// Polling interval of the foot.
const LOOK: Duration = Duration::from_millis(200);

/// Interval of the progress lines.
const LINE: Duration = Duration::from_secs(2);

impl FootArguments {
    /// Waits at most `seconds` until the foot has learnt enough, then stores the calibration.
    pub(super) fn calibrate(&self, client: &mut Client, seconds: f64) -> Result<String, FootError> {
        let clock = client.clock();
        let end = clock.now() + Duration::from_secs_f64(seconds);
        let mut next_line = clock.now();
        loop {
            match calibration::state(client)? {
                CalibrationState::Frozen => return Err(FootError::LearnsNothing),
                CalibrationState::Settled => break,
                CalibrationState::Settling => {}
            }
            let is_over = clock.now() >= end;
            if is_over || clock.now() >= next_line {
                let seen = seen(&calibration::numbers(client, index::CALIBRATION)?);
                if is_over {
                    return Err(FootError::NotSettled { seconds, seen });
                }
                messages::aside(format!("let the foot walk: {seen}\n"));
                next_line = clock.now() + LINE;
            }
            client.wait(LOOK)?;
        }
        // An interruption while storing would leave the foot not streaming.
        finish_when_interrupted();
        calibration::store(client, Calibration::Keep)?;
        // The stored numbers (0x2018): the current ones (0x2120) go on changing.
        let learnt = calibration::numbers(client, index::LEARNT)?;
        let correction = calibration::numbers(client, index::ACCELEROMETER)?;
        let gyroscope_bias_rad_s = calibration::gyroscope_bias_rad_s(client)?;
        Ok(match self.json {
            true => to_json(&json!({
                "learnt": by_name(&learnt),
                "accelerometer_correction": by_name(&correction),
                "gyroscope_bias_rad_s": gyroscope_bias_rad_s,
            })),
            false => text(&learnt, gyroscope_bias_rad_s, &correction),
        })
    }
}

/// Returns how much stillness and motion the foot has observed.
fn seen(learnt: &[(Named, f32)]) -> String {
    let seconds = |name: &str| {
        let of_name = learnt.iter().find(|(named, _)| named.name() == name);
        of_name.map_or(0.0, |(_, seconds)| *seconds)
    };
    format!(
        "{:.1} s of stillness and {:.1} s of motion seen",
        seconds("calibration.stillness_learnt_from"),
        seconds("calibration.motion_learnt_from")
    )
}

/// Returns the name without the table that it is in.
fn last_parts(named: &Named) -> String {
    let name = named.name();
    let parts = name.split_once('.').map(|(_, parts)| parts.to_owned());
    parts.unwrap_or(name)
}

fn text(
    learnt: &[(Named, f32)],
    gyroscope_bias_rad_s: [Option<f32>; 3],
    correction: &[(Named, f32)],
) -> String {
    let mut text = String::from("kept and stored\n");
    for (named, value) in learnt {
        // Amplitudes are stored as logarithms and printed as amplitudes.
        let (value, unit) = match named.entry.unit.as_str() {
            "ln(m/s²)" => (value.exp(), "m/s²"),
            "ln(rad/s)" => (value.exp(), "rad/s"),
            unit => (*value, unit),
        };
        text.push_str(&line(&last_parts(named), value, unit));
    }
    for (axis, bias) in ["x", "y", "z"].into_iter().zip(gyroscope_bias_rad_s) {
        let name = format!("gyroscope_bias_{axis}");
        text.push_str(&match bias {
            Some(bias) => line(&name, bias.to_degrees(), "°/s"),
            None => format!("{name:<26} not known yet\n"),
        });
    }
    for (named, value) in correction {
        text.push_str(&line(&named.name(), *value, named.entry.unit.as_str()));
    }
    text
}

fn by_name(numbers: &[(Named, f32)]) -> Map<String, Json> {
    let pairs = numbers.iter();
    let pairs = pairs.map(|(named, value)| (last_parts(named), json!(value)));
    pairs.collect()
}

fn line(name: &str, value: f32, unit: &str) -> String {
    let line = format!("{name:<26} {value:.4} {unit}");
    line.trim_end().to_owned() + "\n"
}
