//! Evaluation of every method on every recording with labels.
//!
//! Figures are computed over all samples of a recording, or of several recordings together. A mean over
//! sets is the mean of the sets' figures.

use std::path::Path;

use estimator_core::Params;
use samples::recording::Label;
use serde::Serialize;

use crate::error::Error;
use crate::labelled::Labelled;
use crate::method::{Causality, ComparedMethod, Knowledge, MethodRun};
use crate::rates::{AtRate, SampleRate, at_rate};
use crate::score::{Answers, Figures, Scores};
use crate::sets::{Family, Pool, Set};
use scoring::scored::Scored;

/// Recordings that are evaluated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EvaluatedSet {
    /// The set.
    pub set: Set,
    /// The family it belongs to.
    pub family: Family,
    /// The names of its recordings.
    pub recordings: Vec<String>,
    /// Number of samples in all of them.
    pub samples: usize,
    /// Sample rate, Hz.
    pub sample_rate_hz: f32,
    /// Share of the samples with the label "stable", in [0, 1].
    pub stable_share: f64,
}

/// A method's figures on one set.
#[derive(Clone, Debug, Serialize)]
pub struct OnSet {
    /// The set.
    pub set: Set,
    /// Prior knowledge of the method.
    #[serde(flatten)]
    pub knowledge: Knowledge,
    /// How it did.
    pub figures: Figures,
    /// Its probability at each sample, recording after recording.
    #[serde(skip)]
    pub scored: Vec<Scored>,
}

/// A method's figures on the samples of several sets together.
#[derive(Clone, Debug, Serialize)]
pub struct OnPool {
    /// Which.
    pub pool: Pool,
    /// How it did.
    pub figures: Figures,
}

/// A method with all of its figures.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluated {
    /// The method.
    pub method: ComparedMethod,
    /// Its name in tables.
    pub name: String,
    /// Whether a robot can run it.
    pub causality: Causality,
    /// The mean over the sets of [`Set::AVERAGED`]; `None` where the method cannot run on one.
    pub mean: Option<Scores>,
    /// The mean over the sets of [`Set::ROBOTS`]; `None` where the method cannot run on one.
    pub robots: Option<Scores>,
    /// Pool by pool, in the order of [`Pool::ALL`].
    pub pools: Vec<OnPool>,
    /// Set by set, in the order of [`Set::ALL`], without those on which the method cannot run.
    pub sets: Vec<OnSet>,
}

/// Every method on every set.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// The sets, in the order of [`Set::ALL`].
    pub sets: Vec<EvaluatedSet>,
    /// The methods, in the order of [`ComparedMethod::ALL`].
    pub methods: Vec<Evaluated>,
    /// The default preset at several sample rates, in the order of [`SampleRate::ALL`].
    pub rates: Vec<AtRate>,
}

impl Evaluation {
    /// Runs every method on every set; files are in the folder of datasets.
    ///
    /// # Errors
    /// A recording is missing or damaged, or the estimator refuses its sample rate.
    pub fn run(datasets: &Path) -> Result<Self, Error> {
        let recordings = Labelled::of_sets(Set::ALL, datasets)?;
        let methods = ComparedMethod::ALL
            .into_iter()
            .map(|method| {
                let runs = method.run(&recordings)?;
                Ok(Evaluated::of(method, &recordings, &runs))
            })
            .collect::<Result<_, Error>>()?;
        Ok(Self {
            sets: Set::ALL
                .map(|set| EvaluatedSet::of(set, &recordings))
                .into(),
            methods,
            rates: SampleRate::ALL
                .into_iter()
                .map(|rate| at_rate(&recordings, rate, &Params::DEFAULT))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Figures of a method; `None` if it was not run.
    #[must_use]
    pub fn evaluated(&self, method: ComparedMethod) -> Option<&Evaluated> {
        self.methods.iter().find(|e| e.method == method)
    }

    /// Probabilities of a method at each sample of the sets selected by `of`.
    #[must_use]
    pub fn scored(&self, method: ComparedMethod, of: impl Fn(Set) -> bool) -> Vec<Scored> {
        let sets = self.evaluated(method).into_iter().flat_map(|e| &e.sets);
        let scored = sets.filter(|on| of(on.set)).flat_map(|on| &on.scored);
        scored.copied().collect()
    }
}

impl EvaluatedSet {
    fn of(set: Set, recordings: &[Labelled]) -> Self {
        let of_set = || recordings.iter().filter(|file| file.set == set);
        let labels = || of_set().flat_map(Labelled::labels);
        let stable = labels().filter(|label| *label == Label::Stable).count();
        Self {
            set,
            family: set.family(),
            recordings: of_set().map(|file| file.name().to_owned()).collect(),
            samples: of_set().map(|file| file.recording.samples.len()).sum(),
            sample_rate_hz: of_set().next().map_or(0.0, |f| f.recording.sample_rate),
            stable_share: stable as f64 / labels().count().max(1) as f64,
        }
    }
}

impl Evaluated {
    fn of(method: ComparedMethod, recordings: &[Labelled], runs: &[Option<MethodRun>]) -> Self {
        let runs_on = |holds: &dyn Fn(Set) -> bool| -> Vec<&MethodRun> {
            let runs = recordings.iter().zip(runs);
            let held = runs.filter(|(file, _)| holds(file.set));
            held.filter_map(|(_, run)| run.as_ref()).collect()
        };
        let sets: Vec<OnSet> = Set::ALL
            .into_iter()
            .filter_map(|set| OnSet::of(set, &runs_on(&|other| other == set)))
            .collect();
        let mean = |over: &[Set]| -> Option<Scores> {
            let scores = over.iter().map(|set| {
                let found = sets.iter().find(|on| on.set == *set);
                found.map(|on| on.figures.scores)
            });
            Scores::mean(&scores.collect::<Option<Vec<_>>>()?)
        };
        let pools = Pool::ALL
            .into_iter()
            .filter_map(|pool| OnPool::of(pool, &runs_on(&|set| pool.sets().contains(&set))));
        Self {
            method,
            name: method.name(),
            causality: method.causality(),
            mean: mean(&Set::AVERAGED),
            robots: mean(&Set::ROBOTS),
            pools: pools.collect(),
            sets,
        }
    }

    /// Figures on a set; `None` if the method cannot run on it.
    #[must_use]
    pub fn on_set(&self, set: Set) -> Option<&Figures> {
        let found = self.sets.iter().find(|on| on.set == set);
        found.map(|on| &on.figures)
    }

    /// Figures on a pool; `None` if the method cannot run on any of its sets.
    #[must_use]
    pub fn on_pool(&self, pool: Pool) -> Option<&Figures> {
        let found = self.pools.iter().find(|on| on.pool == pool);
        found.map(|on| &on.figures)
    }
}

impl OnSet {
    fn of(set: Set, runs: &[&MethodRun]) -> Option<Self> {
        let answers: Vec<&Answers> = runs.iter().map(|run| &run.answers).collect();
        let scored = answers.iter().flat_map(|answers| &answers.scored);
        Some(Self {
            set,
            knowledge: Knowledge::of_all(runs),
            figures: Figures::of(&answers)?,
            scored: scored.copied().collect(),
        })
    }
}

impl OnPool {
    fn of(pool: Pool, runs: &[&MethodRun]) -> Option<Self> {
        let answers: Vec<&Answers> = runs.iter().map(|run| &run.answers).collect();
        Some(Self {
            pool,
            figures: Figures::of(&answers)?,
        })
    }
}
