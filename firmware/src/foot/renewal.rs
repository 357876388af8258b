//! A new estimator, where settings that concern it have changed.

use estimator_core::{ContactEstimator, Params};

use super::Foot;

/// How a new estimator starts. Of two, the greater counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Renewal {
    /// With what the previous one has learnt.
    Continue,
    /// With what the settings hold as learnt.
    Restart,
}

impl Foot {
    /// Asks for a new estimator, from the next estimate on.
    pub(super) fn renew(&mut self, renewal: Renewal) {
        self.renewal = self.renewal.max(Some(renewal));
    }

    /// Replaces the estimator, where that was asked for.
    pub(super) fn renew_estimator(&mut self) {
        if let Some(renewal) = self.renewal.take() {
            self.replace_estimator(renewal);
        }
    }

    /// Apart from the tick, whose stack would otherwise have room for a second estimator each time.
    #[inline(never)]
    fn replace_estimator(&mut self, renewal: Renewal) {
        self.accelerometer = self.settings().accelerometer();
        self.mounting = self.settings().mounting();
        let settings = self.settings().params();
        let learnt = match renewal {
            Renewal::Continue => Some(self.learnt()),
            Renewal::Restart => settings.learnt,
        };
        if let Ok(config) = (Params { learnt, ..settings }).validate() {
            self.estimator = ContactEstimator::new(&config);
        }
    }
}
