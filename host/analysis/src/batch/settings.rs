//! Settings for reading and estimating recordings, and their hash.

use std::collections::{BTreeMap, BTreeSet};

use recordings::input::{
    ContactUse, Correction, Decimal, Format, Hints, Scale, TableOptions, TimeUnit, Topics, is_among,
};
use serde::Serialize;

use crate::config::{GRAVITIES, LearntValues, Resolved, word_of};
use crate::parameters::{CorrectionReport, ParametersReport};

/// Treatment of implausible recordings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plausibility {
    /// The findings are listed in the row.
    #[default]
    Reported,
    /// The recording fails.
    Required,
}

/// Selection of the feet of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum FeetWanted {
    /// All feet that are read.
    #[default]
    All,
    /// The foot with this name.
    Named(String),
}

/// Settings for reading and estimating recordings.
#[derive(Debug, Default)]
pub struct BatchSettings {
    /// Settings of preset, configuration file and options.
    pub resolved: Resolved,
    /// Format of all recordings, if given.
    pub format: Option<Format>,
    /// Properties of the files beyond their format: those of `resolved`, and the options of reading.
    pub hints: Hints,
    /// Treatment of implausible recordings.
    pub plausibility: Plausibility,
    /// Selected feet. The selection changes no result and is not part of the hash.
    pub feet: FeetWanted,
}

impl BatchSettings {
    /// Returns the feet with a correction of their own that is that of no recording: neither are they among the names
    /// `feet`, nor is their correction among `corrections`, each a JSON object as in the row of a recording.
    #[must_use]
    pub fn feet_without_recording(
        &self,
        feet: &BTreeSet<String>,
        corrections: &BTreeSet<String>,
    ) -> Vec<&str> {
        let is_applied = |correction: &Correction| {
            let report = serde_json::to_string(&CorrectionReport::from(correction));
            report.is_ok_and(|report| corrections.contains(&report))
        };
        let own = self.hints.foot_corrections.iter();
        own.filter(|(foot, correction)| !is_among(foot, feet) && !is_applied(correction))
            .map(|(foot, _)| foot.as_str())
            .collect()
    }

    /// Returns the BLAKE3 hash, in hexadecimal, of everything that affects results besides the recording and the
    /// version.
    #[must_use]
    pub fn blake3(&self) -> String {
        let Hints {
            sample_rate,
            gravity,
            correction,
            foot_corrections,
            table,
            bag,
            contacts,
        } = &self.hints;
        let TableOptions {
            mapping,
            units,
            scale,
            decimal,
            time_unit,
            times,
        } = table;
        let feet = &self.resolved.overrides.feet;
        let all = Hashed {
            preset: self.resolved.preset.name(),
            parameters: Format::ALL
                .map(|format| ParametersReport::of(&self.resolved.params(format))),
            format: self.format.map(Format::name),
            sample_rate: *sample_rate,
            gravity: gravity.map(|gravity| word_of(&GRAVITIES, gravity)),
            correction: CorrectionReport::from(correction),
            foot_corrections: foot_corrections
                .iter()
                .map(|(foot, correction)| (foot.clone(), CorrectionReport::from(correction)))
                .collect(),
            foot_learnt: feet
                .iter()
                .filter_map(|(foot, own)| Some((foot.clone(), own.learnt?)))
                .collect(),
            foot_numbers: feet
                .iter()
                .map(|(foot, own)| (foot.clone(), own.numbers()))
                .filter(|(_, numbers)| !numbers.is_empty())
                .collect(),
            map: mapping.to_string(),
            units: units.to_string(),
            scale: (*scale != Scale::default()).then(|| scale.to_string()),
            decimal: (*decimal != Decimal::default()).then(|| decimal.name()),
            time_unit: time_unit.map(TimeUnit::name),
            times: times.name(),
            topics: match &bag.topics {
                Topics::TheOnly => None,
                Topics::All => Some(Vec::new()),
                Topics::Named(names) => Some(names.clone()),
            },
            frames: bag.frames.clone(),
            excluded: bag.excluded.clone(),
            loads: bag.loads.iter().map(ToString::to_string).collect(),
            contacts: (*contacts == ContactUse::Recorded).then_some("recorded"),
            strict: self.plausibility == Plausibility::Required,
        };
        // Strings and numbers always serialise to JSON.
        let text = serde_json::to_vec(&all).unwrap_or_default();
        blake3::hash(&text).to_string()
    }
}

/// Hashed content. Fields become JSON in their order here, whatever machine it is.
#[derive(Serialize)]
struct Hashed {
    preset: &'static str,
    /// For each format: those of a recording depend on it.
    parameters: [ParametersReport; Format::ALL.len()],
    format: Option<&'static str>,
    sample_rate: Option<f32>,
    gravity: Option<&'static str>,
    correction: CorrectionReport,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    foot_corrections: BTreeMap<String, CorrectionReport>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    foot_learnt: BTreeMap<String, LearntValues>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    foot_numbers: BTreeMap<String, BTreeMap<&'static str, f32>>,
    map: String,
    units: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    decimal: Option<&'static str>,
    time_unit: Option<&'static str>,
    times: &'static str,
    /// All where it is empty, the only one where it is not there.
    topics: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    frames: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    excluded: Vec<String>,
    loads: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<&'static str>,
    strict: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Overrides, Preset};
    use estimator_core::{Gravity, WindowLength};
    use recordings::input::Times;

    #[test]
    fn hash_depends_on_settings_but_not_on_feet() {
        fn threshold() -> Overrides {
            Overrides::parse("decision.threshold = 0.6", "x").unwrap()
        }
        let set = |change: fn(&mut BatchSettings)| {
            let mut settings = BatchSettings::default();
            change(&mut settings);
            settings.blake3()
        };
        let of_feet = |text: &str| {
            let overrides = Overrides::parse(text, "x").unwrap();
            let foot_corrections = overrides.foot_corrections("x").unwrap();
            let mut settings = BatchSettings::default();
            settings.resolved.overrides = overrides;
            settings.hints.foot_corrections = foot_corrections;
            settings.blake3()
        };
        let unchanged = set(|_| ());
        assert_eq!(
            unchanged,
            set(|s| s.feet = FeetWanted::Named("fl".to_owned()))
        );
        let changed = [
            set(|s| s.resolved.preset = Preset::Paper),
            set(|s| s.resolved.overrides = threshold()),
            of_feet("feet.fl.load.on_threshold = 20"),
            of_feet("feet.fr.load.on_threshold = 20"),
            of_feet("feet.fl.decision.threshold = 0.6"),
            of_feet("feet.fl.axes = '-x,-y,z'"),
            set(|s| s.resolved.window = Some(WindowLength::Samples(7))),
            set(|s| s.format = Some(Format::Csv)),
            set(|s| s.hints.sample_rate = Some(100.0)),
            set(|s| s.hints.gravity = Some(Gravity::Removed)),
            set(|s| s.hints.correction.gyroscope_bias.x = 1.0e-3),
            set(|s| s.hints.table.mapping = "ax=a".parse().unwrap()),
            set(|s| s.hints.table.units = "g".parse().unwrap()),
            set(|s| s.hints.table.units = "dps".parse().unwrap()),
            set(|s| s.hints.table.scale = "1,2".parse().unwrap()),
            set(|s| s.hints.table.decimal = Decimal::Comma),
            set(|s| s.hints.table.time_unit = Some("ms".parse().unwrap())),
            set(|s| s.hints.table.times = Times::Rate),
            set(|s| s.hints.bag.topics = Topics::All),
            set(|s| s.hints.bag.excluded = vec!["/trunk".to_owned()]),
            set(|s| s.hints.bag.frames = vec!["fl".to_owned()]),
            set(|s| s.hints.bag.loads = vec!["/load".parse().unwrap()]),
            set(|s| s.hints.contacts = ContactUse::Recorded),
            set(|s| s.plausibility = Plausibility::Required),
        ];
        for (k, hash) in changed.iter().enumerate() {
            assert!(*hash != unchanged && !changed[..k].contains(hash), "{k}");
        }
    }
}
