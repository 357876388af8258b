//! Evaluation of the estimator at several sample rates. The figures should be similar, because the motion of
//! a foot does not depend on the sample rate.

use estimator_core::{Params, ParamsError};
use recordings::replay::replay;
use scoring::scored::Scored;
use serde::Serialize;

use crate::labelled::Labelled;
use crate::resample::resample;
use crate::score::{Answers, Figures, Scores};
use crate::sets::{Pool, Set};

/// A sample rate at which recordings are scored.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleRate {
    /// That of the recording.
    Native,
    /// One that it is [resampled](resample) to, Hz.
    Hz(f32),
}

/// The rate of the board, Hz.
pub const BOARD_RATE: SampleRate = SampleRate::Hz(1000.0);

/// Recordings at or below this rate are not decimated to it, Hz.
const LOWEST: f32 = 100.0;

/// The figures at one sample rate.
#[derive(Clone, Debug, Serialize)]
pub struct AtRate {
    /// The rate.
    pub rate: SampleRate,
    /// The mean over [`Set::AVERAGED`]; `None` where one of them is not at this rate.
    pub mean: Option<Scores>,
    /// The mean over [`Set::ROBOTS`]; `None` where one of them is not at this rate.
    pub robots: Option<Scores>,
    /// The sets of ATLAS that the paper reports on, all samples together.
    pub atlas_pooled: Option<Scores>,
    /// The sets of LCD, all samples together; `None` where they are not at this rate.
    pub lcd_pooled: Option<Scores>,
    /// Set by set, in the order of [`Set::ALL`], without those that are not at this rate.
    pub sets: Vec<SetAtRate>,
}

/// The figures of a set at one sample rate.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SetAtRate {
    /// The set.
    pub set: Set,
    /// Its figures.
    #[serde(flatten)]
    pub scores: Scores,
}

impl SampleRate {
    /// All sample rates in display order.
    pub const ALL: [Self; 6] = [
        Self::Native,
        Self::Hz(LOWEST),
        Self::Hz(390.0),
        Self::Hz(500.0),
        BOARD_RATE,
        Self::Hz(1660.0),
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Native => "native".to_owned(),
            Self::Hz(rate) => format!("{rate} Hz"),
        }
    }
}

impl AtRate {
    /// Figures of a set; `None` if it is not scored at this rate.
    #[must_use]
    pub fn on_set(&self, set: Set) -> Option<&Scores> {
        let found = self.sets.iter().find(|on| on.set == set);
        found.map(|on| &on.scores)
    }
}

/// Answers of the estimator with `params` on a recording at a sample rate; `None` if it is not scored at this
/// rate.
///
/// # Errors
/// The estimator refuses a parameter or the rate.
pub fn answers(
    file: &Labelled,
    rate: SampleRate,
    params: &Params,
) -> Result<Option<Answers>, ParamsError> {
    let resampled = match rate {
        SampleRate::Native => file.recording.clone(),
        SampleRate::Hz(rate) if rate.max(file.recording.sample_rate) <= LOWEST => return Ok(None),
        SampleRate::Hz(rate) => resample(&file.recording, rate),
    };
    let estimates = replay(&resampled, params)?;
    let scored = Scored::collect(&resampled.samples, &estimates);
    Ok(Some(Answers::of(scored)))
}

/// Computes the figures of `params` at one rate.
///
/// # Errors
/// Those of [`answers`].
pub fn at_rate(
    recordings: &[Labelled],
    rate: SampleRate,
    params: &Params,
) -> Result<AtRate, ParamsError> {
    let runs = recordings.iter().map(|file| answers(file, rate, params));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let pooled = |of: &[Set]| -> Option<Scores> {
        let runs = recordings.iter().zip(&runs);
        let runs = runs.filter(|(file, _)| of.contains(&file.set));
        let runs: Option<Vec<&Answers>> = runs.map(|(_, run)| run.as_ref()).collect();
        Some(Figures::of(&runs?)?.scores)
    };
    let mean = |over: &[Set]| -> Option<Scores> {
        let scores: Option<Vec<_>> = over.iter().map(|set| pooled(&[*set])).collect();
        Scores::mean(&scores?)
    };
    let of_set = |set| pooled(&[set]).map(|scores| SetAtRate { set, scores });
    Ok(AtRate {
        rate,
        mean: mean(&Set::AVERAGED),
        robots: mean(&Set::ROBOTS),
        atlas_pooled: pooled(Pool::Atlas.sets()),
        lcd_pooled: pooled(Pool::Lcd.sets()),
        sets: Set::ALL.into_iter().filter_map(of_set).collect(),
    })
}
