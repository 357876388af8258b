//! Configuration file written by a calibration, in the form that [`config`](crate::config) reads.

use estimator_core::stillness::Classes;
use estimator_core::{Learnt, Mounting};
use toml::{Table, Value};

use super::learnt::LearntFoot;
use super::mounting::MountingReport;
use super::sensor::SensorCalibration;

/// Configuration file with calibrated values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotFile {
    remarks: Vec<String>,
    tables: Table,
    /// Foot whose settings are set; those of all feet if it is `None`.
    foot: Option<String>,
}

impl RobotFile {
    /// Starts from the settings in another file's text, without its comments.
    ///
    /// # Errors
    /// The text is not TOML.
    pub fn keeping(other: &str) -> Result<Self, toml::de::Error> {
        Ok(Self {
            remarks: Vec::new(),
            tables: other.parse()?,
            foot: None,
        })
    }

    /// Sets the settings of one foot, in `[feet.NAME]`, from here on.
    #[must_use]
    pub fn of_foot(self, foot: Option<String>) -> Self {
        Self { foot, ..self }
    }

    /// The table in which keys are set.
    fn table(&mut self) -> &mut Table {
        let Some(foot) = &self.foot else {
            return &mut self.tables;
        };
        let feet = sub_table(&mut self.tables, "feet");
        let known = feet.keys().find(|name| name.eq_ignore_ascii_case(foot));
        let name = known.unwrap_or(foot).clone();
        sub_table(feet, &name)
    }

    /// Sets the learnt values of a foot.
    pub fn set_learnt(&mut self, foot: &LearntFoot) {
        let recordings: Vec<&str> = foot
            .recordings
            .iter()
            .map(|from| from.recording.as_str())
            .collect();
        self.remarks.push(format!(
            "learnt from {:.1} s of stance and {:.1} s of swing in {}",
            foot.stance_s,
            foot.swing_s,
            recordings.join(", ")
        ));
        let Learnt {
            acceleration,
            rate,
            velocity,
            still_seconds,
            moving_seconds,
            idle_seconds,
        } = foot.learnt;
        // Earlier learnt values are replaced as a whole.
        self.table().remove("learnt");
        for (key, seconds) in [
            ("still_seconds", still_seconds),
            ("moving_seconds", moving_seconds),
            ("idle_seconds", idle_seconds),
        ] {
            self.set("learnt", key, Value::Float(shortest(seconds)));
        }
        for (key, classes) in [
            ("acceleration", acceleration),
            ("rate", rate),
            ("velocity", velocity),
        ] {
            let Classes {
                still,
                moving,
                width,
            } = classes;
            let values = [("still", still), ("moving", moving), ("width", width)];
            self.set("learnt", key, table(&values));
        }
    }

    /// Sets the mounting; `None` if the sensor's axes are those of the foot.
    pub fn set_mounting(&mut self, mounting: Option<&MountingReport>) {
        const KEY: &str = "axes";
        match mounting {
            Some(report) => {
                self.remarks.push(report.remark());
                let axes = report.axes.to_string();
                self.table().insert(KEY.to_owned(), Value::String(axes));
            }
            // Without axes of its own the foot would have those of all.
            None if self.foot.is_some() && self.tables.contains_key(KEY) => {
                let axes = Mounting::IDENTITY.to_string();
                self.table().insert(KEY.to_owned(), Value::String(axes));
            }
            None => {
                self.table().remove(KEY);
            }
        }
    }

    /// Sets the correction of the sensor.
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
            table(&[("ax", bx), ("ay", by), ("az", bz)]),
        );
        self.set(
            "accelerometer",
            "scale",
            table(&[("ax", sx), ("ay", sy), ("az", sz)]),
        );
        self.set(
            "gyroscope",
            "bias_rad_s",
            table(&[("wx", gx), ("wy", gy), ("wz", gz)]),
        );
    }

    fn set(&mut self, table: &str, key: &str, value: Value) {
        sub_table(self.table(), table).insert(key.to_owned(), value);
    }

    /// Returns the text of the file.
    #[must_use]
    pub fn text(&self) -> String {
        let remarks: String = self.remarks.iter().map(|r| format!("# {r}\n")).collect();
        format!("{remarks}\n{}", self.tables)
    }
}

/// The table of a name in another one; it is added if there is none.
fn sub_table<'a>(within: &'a mut Table, name: &str) -> &'a mut Table {
    let empty = || Value::Table(Table::new());
    let value = within.entry(name).or_insert_with(empty);
    if !value.is_table() {
        *value = empty();
    }
    match value {
        Value::Table(table) => table,
        _ => unreachable!("a table was just put here"),
    }
}

fn table(values: &[(&str, f32)]) -> Value {
    let values = values.iter();
    let values = values.map(|(key, value)| ((*key).to_owned(), Value::Float(shortest(*value))));
    Value::Table(values.collect())
}

/// Returns the f64 with the fewest digits that reads back as the same f32.
fn shortest(value: f32) -> f64 {
    let exact = f64::from(value);
    let short: f64 = value.to_string().parse().unwrap_or(exact);
    // Parsing through f64 rounds twice.
    if short as f32 == value { short } else { exact }
}
