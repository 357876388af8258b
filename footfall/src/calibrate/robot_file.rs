//! The configuration file that a calibration leaves behind: what [`config`](crate::config) reads.

use toml::{Table, Value};

use super::half_width::HalfWidths;
use super::sensor::SensorCalibration;

/// A configuration file with calibrated values in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotFile {
    remarks: Vec<String>,
    tables: Table,
}

impl RobotFile {
    /// A file that keeps what another one's text sets, but for its comments.
    ///
    /// # Errors
    /// The text is not TOML.
    pub fn keeping(other: &str) -> Result<Self, toml::de::Error> {
        Ok(Self {
            remarks: Vec::new(),
            tables: other.parse()?,
        })
    }

    /// Sets the half-widths.
    pub fn set_half_widths(&mut self, half_widths: &HalfWidths) {
        let recordings: Vec<&str> = half_widths
            .recordings
            .iter()
            .map(|r| r.recording.as_str())
            .collect();
        self.remarks.push(format!(
            "half-widths from {} steps of {}",
            half_widths.steps,
            recordings.join(", ")
        ));
        let [ax, ay, az, wx, wy, wz] = half_widths.half_width.to_array();
        self.set(
            "half_width",
            "acceleration_m_s2",
            &[("ax", ax), ("ay", ay), ("az", az)],
        );
        self.set(
            "half_width",
            "angular_rate_rad_s",
            &[("wx", wx), ("wy", wy), ("wz", wz)],
        );
    }

    /// Sets what is wrong with the sensor.
    pub fn set_sensor(&mut self, sensor: &SensorCalibration) {
        self.remarks.push(format!(
            "accelerometer and gyroscope from {} rests in {} orientations",
            sensor.rests.len(),
            sensor.orientations
        ));
        let [bx, by, bz] = sensor.accelerometer_bias.map(|bias| bias as f32);
        let [sx, sy, sz] = sensor.accelerometer_scale.map(|scale| scale as f32);
        let [gx, gy, gz] = sensor.gyroscope_bias.map(|bias| bias as f32);
        self.set(
            "accelerometer",
            "bias_m_s2",
            &[("ax", bx), ("ay", by), ("az", bz)],
        );
        self.set(
            "accelerometer",
            "scale",
            &[("ax", sx), ("ay", sy), ("az", sz)],
        );
        self.set(
            "gyroscope",
            "bias_rad_s",
            &[("wx", gx), ("wy", gy), ("wz", gz)],
        );
    }

    fn set(&mut self, table: &str, key: &str, axes: &[(&str, f32)]) {
        let axes: Table = axes
            .iter()
            .map(|(axis, value)| ((*axis).to_owned(), Value::Float(shortest(*value))))
            .collect();
        let table = self
            .tables
            .entry(table)
            .or_insert_with(|| Value::Table(Table::new()));
        if let Some(table) = table.as_table_mut() {
            table.insert(key.to_owned(), Value::Table(axes));
        }
    }

    /// The file's text.
    #[must_use]
    pub fn text(&self) -> String {
        let remarks: String = self.remarks.iter().map(|r| format!("# {r}\n")).collect();
        format!("{remarks}\n{}", self.tables)
    }
}

/// The f64 with the fewest digits that reads back as the same f32.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}
