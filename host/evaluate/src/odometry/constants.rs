//! Constants of `sigma_v`, chosen on one half of the walks and scored on the other.

use estimator_core::VelocityParams;

use super::detector::sigmas;
use super::walk::Walk;
use super::{OnWalk, mean, scored};

/// Candidate speeds, m/s.
const SPEEDS: [f32; 5] = [0.03, 0.05, 0.07, 0.1, 0.2];

/// Candidate levers, m.
const LEVERS: [f32; 4] = [0.05, 0.1, 0.15, 0.2];

/// Range of the mean NIS for chosen constants: 3 is ideal, and errors that last for a stance, as those of a
/// rolling foot, lower it.
const NIS: std::ops::RangeInclusive<f64> = 1.5..=4.0;

/// Constants chosen on one half of the walks, with their figures on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitHalf {
    /// Chosen [`VelocityParams::speed`], m/s.
    pub speed_m_s: f32,
    /// Chosen [`VelocityParams::lever`], m.
    pub lever_m: f32,
    /// Mean error of the other walks, m.
    pub error_m: f64,
    /// Mean NIS of the other walks.
    pub nis: f64,
    /// Mean error of the other walks with the default constants, m.
    pub default_error_m: f64,
}

/// Figures of candidate constants for each walk.
struct Candidate {
    params: VelocityParams,
    walks: Vec<OnWalk>,
}

/// Chooses the constants on every second walk and scores them on the others, in both directions. The chosen
/// constants have the least mean error among those with a mean NIS of 1.5 to 4.
#[must_use]
pub fn split_halves(walks: &[Walk]) -> Vec<SplitHalf> {
    let params = SPEEDS.into_iter().flat_map(|speed| {
        LEVERS.map(|lever| VelocityParams {
            speed,
            lever,
            ..VelocityParams::DEFAULT
        })
    });
    let candidate = |params| Candidate {
        params,
        walks: walks
            .iter()
            .map(|walk| scored(walk, &sigmas(&walk.estimates, &params)))
            .collect(),
    };
    let candidates: Vec<Candidate> = params.map(candidate).collect();
    let default = candidate(VelocityParams::DEFAULT);
    let halves = [0, 1].into_iter();
    let halves = halves.filter_map(|half| {
        let acceptable = candidates.iter().filter(|of| NIS.contains(&of.nis(half)));
        let chosen = acceptable.min_by(|a, b| a.error(half).total_cmp(&b.error(half)))?;
        Some(SplitHalf {
            speed_m_s: chosen.params.speed,
            lever_m: chosen.params.lever,
            error_m: chosen.error(1 - half),
            nis: chosen.nis(1 - half),
            default_error_m: default.error(1 - half),
        })
    });
    halves.collect()
}

impl Candidate {
    fn error(&self, half: usize) -> f64 {
        mean(self.half(half).map(|walk| walk.error_m))
    }

    fn nis(&self, half: usize) -> f64 {
        mean(self.half(half).filter_map(|walk| walk.nis))
    }

    fn half(&self, half: usize) -> impl Iterator<Item = &OnWalk> {
        self.walks.iter().skip(half).step_by(2)
    }
}
