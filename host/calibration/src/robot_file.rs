//! Configuration file written by a calibration, in the form that the crate `config` reads.

use std::collections::BTreeMap;

use estimator_core::Learnt;
use estimator_core::mounting::Mounting;
use estimator_core::parameter::Parameter;
use toml::{Table, Value};

use crate::learnt::LearntFoot;
use crate::sensor::SensorCalibration;
use replay::summary::LoadThresholds;
use samples::mounting::{MountingReport, axes_text, parse_axes, settings_of};

/// Configuration file with calibrated values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotFile {
    remarks: Vec<String>,
    tables: Table,
    /// Foot whose settings are changed; `None` changes the settings of all feet.
    foot: Option<String>,
}

impl RobotFile {
    /// Starts from the settings in another file's text, without its comments.
    ///
    /// # Errors
    /// The text is not TOML.
    pub fn keeping(other: &str) -> Result<Self, toml::de::Error> {
        Ok(Self { remarks: Vec::new(), tables: other.parse()?, foot: None })
    }

    /// Makes all later changes apply to the settings of one foot, in `[feet.NAME]`; `None` for all feet.
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
        let recordings: Vec<&str> =
            foot.recordings.iter().map(|from| from.recording.as_str()).collect();
        self.remarks.push(format!(
            "learnt from {:.1} s of stance and {:.1} s of swing in {}",
            foot.stance_s,
            foot.swing_s,
            recordings.join(", ")
        ));
        self.set_learnt_values(&foot.learnt);
        if let Ok(lever) = &foot.lever {
            self.remarks.push(lever.to_string());
            self.set(Parameter::VelocityLever.name(), lever.lever_m);
        }
    }

    /// Sets the values that a foot has learnt by itself.
    pub fn set_learnt_by_foot(&mut self, foot: &str, learnt: &Learnt) {
        self.remarks.push(format!("learnt by the foot {foot} while it walked"));
        self.set_learnt_values(learnt);
    }

    fn set_learnt_values(&mut self, learnt: &Learnt) {
        // Earlier learnt values are replaced as a whole.
        self.table().remove("learnt");
        for (row, value) in Learnt::ROWS.iter().zip(learnt.to_array()) {
            self.set(row.name, value);
        }
        let table = sub_table(self.table(), "learnt");
        for (key, value) in [("version", Learnt::VERSION), ("crc", learnt.crc())] {
            table.insert(key.to_owned(), Value::Integer(value.into()));
        }
    }

    /// Sets the mounting; `None` if the sensor's axes are the axes of the foot.
    pub fn set_mounting(&mut self, mounting: Option<&MountingReport>) {
        const KEY: &str = "axes";
        match mounting {
            Some(report) => {
                self.remarks.push(report.remark());
                let axes = axes_text(&report.axes);
                self.table().insert(KEY.to_owned(), Value::String(axes));
            }
            // Write even the default, because a foot without axes of its own has the axes of all feet.
            None if self.foot.is_some() && self.tables.contains_key(KEY) => {
                let axes = axes_text(&Mounting::IDENTITY);
                self.table().insert(KEY.to_owned(), Value::String(axes));
            }
            None => {
                self.table().remove(KEY);
            }
        }
    }

    /// Sets the thresholds of the load.
    pub fn set_load(&mut self, load: &LoadThresholds) {
        self.remarks.push("thresholds of the load from its levels in swing and stance".to_owned());
        self.set("load.on_threshold", load.on_threshold);
        self.set("load.off_threshold", load.off_threshold);
    }

    /// Sets the correction of the sensor.
    pub fn set_sensor(&mut self, sensor: &SensorCalibration) {
        self.remarks.push(format!(
            "accelerometer and gyroscope from {} rests in {} orientations",
            sensor.rests.len(),
            sensor.orientations
        ));
        let (force, rate) = (["ax", "ay", "az"], ["wx", "wy", "wz"]);
        for (key, axes, values) in [
            ("accelerometer.bias_m_s2", force, sensor.accelerometer_bias),
            ("accelerometer.scale", force, sensor.accelerometer_scale),
            ("gyroscope.bias_rad_s", rate, sensor.gyroscope_bias),
        ] {
            for (axis, value) in axes.into_iter().zip(values) {
                self.set(&format!("{key}.{axis}"), value as f32);
            }
        }
    }

    /// Sets the value at a path of tables and a key, such as `velocity.lever_m`. Adds missing tables.
    fn set(&mut self, path: &str, value: f32) {
        let mut names: Vec<&str> = path.split('.').collect();
        let key = names.pop().unwrap_or_default();
        let table = names.into_iter().fold(self.table(), sub_table);
        table.insert(key.to_owned(), Value::Float(shortest(value)));
    }

    /// Names and values of the settings of a foot: from the tables of all feet, and from its own table, which wins. A
    /// mounting has the names of the foot's settings.
    #[must_use]
    pub fn settings_of_foot(&self, foot: &str) -> Vec<(String, String)> {
        let mut found = BTreeMap::new();
        let mut general = self.tables.clone();
        let feet = general.remove("feet");
        let own = feet.as_ref().and_then(Value::as_table).and_then(|feet| {
            let mut named = feet.iter();
            named
                .find(|(name, _)| name.eq_ignore_ascii_case(foot))
                .and_then(|(_, of)| of.as_table())
        });
        // All learnt values belong together.
        if own.is_some_and(|own| own.contains_key("learnt")) {
            general.remove("learnt");
        }
        for table in [Some(&general), own].into_iter().flatten() {
            flatten("", table, &mut found);
        }
        let mounting = found.get("axes").and_then(|axes| parse_axes(axes).ok());
        let mounting = mounting.iter().flat_map(settings_of);
        let mounting: Vec<_> = mounting.map(|(name, value)| (name.to_owned(), value)).collect();
        found.extend(mounting);
        found.into_iter().collect()
    }

    /// Returns the text of the file.
    #[must_use]
    pub fn text(&self) -> String {
        let remarks: String = self.remarks.iter().map(|r| format!("# {r}\n")).collect();
        format!("{remarks}\n{}", self.tables)
    }
}

/// Adds the values of a table by their names, with the names of the tables around them.
fn flatten(within: &str, table: &Table, found: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let name = format!("{within}{key}");
        match value {
            Value::Table(table) => flatten(&format!("{name}."), table, found),
            Value::String(text) => {
                found.insert(name, text.clone());
            }
            value => {
                found.insert(name, value.to_string());
            }
        }
    }
}

/// Returns the table `name` in the table `within`. Inserts an empty table if it is missing or is no table.
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

/// Returns the f64 with the fewest digits that reads back as the same f32.
fn shortest(value: f32) -> f64 {
    let exact = f64::from(value);
    let short: f64 = value.to_string().parse().unwrap_or(exact);
    // Parsing through f64 rounds twice.
    if short as f32 == value { short } else { exact }
}
