//! Replacement of the estimator after a change of settings that concern it.

use estimator_core::{ContactEstimator, Params};

use super::Foot;

/// Start of a new estimator. Of two requests, the greater takes precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Renewal {
    /// With the values learnt by the previous one.
    Continue,
    /// With the learnt values of the settings.
    Restart,
}

impl Foot {
    /// Requests a new estimator, from the next estimate on.
    pub(super) fn renew(&mut self, renewal: Renewal) {
        self.renewal = self.renewal.max(Some(renewal));
    }

    /// Replaces the estimator, if requested.
    pub(super) fn renew_estimator(&mut self) {
        let Some(renewal) = self.renewal.take() else {
            return;
        };
        let settings = self.settings().params();
        let learnt = match renewal {
            Renewal::Continue => Some(self.learnt()),
            Renewal::Restart => settings.learnt,
        };
        let params = Params { learnt, sample_rate: 1.0e6 / self.tick_us as f32, ..settings };
        if let Ok(config) = params.validate() {
            self.estimator = ContactEstimator::new(&config);
        }
    }
}
