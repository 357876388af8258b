//! Segment of a motion: a stance, a peel or a swing.
//!
//! It has three positions and three angles, each a base path plus terms, and the load during contact.

use crate::activity::Activity;
use crate::jet::Jet;
use crate::shape::{Quintic, Shape, Term};
use crate::step::Slip;

/// x, y, z, roll, pitch, yaw.
pub(crate) const CHANNELS: usize = 6;
pub(crate) const X: usize = 0;
pub(crate) const Y: usize = 1;
pub(crate) const Z: usize = 2;
pub(crate) const ROLL: usize = 3;
pub(crate) const PITCH: usize = 4;
pub(crate) const YAW: usize = 5;

/// State of all channels.
pub(crate) type Pose = [Jet; CHANNELS];

/// Mass of foot and shank that an impact stops, kg.
const EFFECTIVE_MASS: f64 = 0.25;

/// Transition from 0 to 1, with least jerk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    /// s.
    pub start: f64,
    /// s, positive.
    pub duration: f64,
}

impl Change {
    /// Change that is always complete.
    pub const ALREADY: Self = Self { start: f64::NEG_INFINITY, duration: 1.0 };

    /// Change that never begins.
    pub const NEVER: Self = Self { start: f64::INFINITY, duration: 1.0 };

    /// Returns the progress at time `t` in s.
    pub fn progress(self, t: f64) -> f64 {
        let shape = Shape::Slide { distance: 1.0 };
        Term::new(self.start, self.duration, shape).at(t).value
    }
}

/// Vertical load over one contact: it builds up, stays, and decreases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoadProfile {
    /// N.
    pub level: f64,
    pub rise: Change,
    pub fall: Change,
}

impl LoadProfile {
    fn at(&self, t: f64) -> f64 {
        self.level * self.rise.progress(t) * (1.0 - self.fall.progress(t))
    }
}

/// Contact of the foot.
#[derive(Clone, Debug)]
pub(crate) enum Kind {
    /// The whole sole is on the ground.
    Stance {
        /// End of the landing, s.
        settled: f64,
        /// Slides; their onsets count from the segment's start.
        slips: Vec<Slip>,
    },
    /// The toes are on the ground.
    Peel,
    /// No contact.
    Swing,
}

/// Piece of a motion; it ends where the next one starts.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    pub kind: Kind,
    /// s.
    pub start: f64,
    pub base: [Quintic; CHANNELS],
    /// Terms, each with its channel.
    pub terms: Vec<(usize, Term)>,
    /// Load; `None` in the air.
    pub load: Option<LoadProfile>,
}

impl Segment {
    /// Returns position and motion of the foot at time `t` in s.
    pub fn pose(&self, t: f64) -> Pose {
        let mut pose = self.base.map(|path| path.at(t));
        for (channel, term) in &self.terms {
            pose[*channel] += term.at(t);
        }
        pose
    }

    /// Returns the activity of the foot at time `t` in s.
    pub fn activity(&self, t: f64) -> Activity {
        match &self.kind {
            Kind::Peel => Activity::Peeling,
            Kind::Swing => Activity::Swinging,
            Kind::Stance { slips, settled } => {
                let since_start = t - self.start;
                let slides =
                    |slip: &Slip| (slip.onset..slip.onset + slip.duration).contains(&since_start);
                if slips.iter().any(slides) {
                    Activity::Slipping
                } else if t < *settled {
                    Activity::Landing
                } else {
                    Activity::Standing
                }
            }
        }
    }

    /// Returns the vertical load in N at time `t` in s, while the foot accelerates upwards by
    /// `upward_acceleration` in m/s².
    pub fn load(&self, t: f64, upward_acceleration: f64) -> f64 {
        let profile = self.load.map_or(0.0, |profile| profile.at(t));
        match self.kind {
            // The ground also stops the foot itself; it cannot pull.
            Kind::Stance { .. } => (profile + EFFECTIVE_MASS * upward_acceleration).max(0.0),
            Kind::Peel | Kind::Swing => profile,
        }
    }

    /// Returns the distance slid from the segment's start to time `t` in s, m.
    pub fn slip(&self, t: f64) -> f64 {
        match &self.kind {
            Kind::Stance { slips, .. } => slips
                .iter()
                .map(|slip| {
                    let slide = Change { start: self.start + slip.onset, duration: slip.duration };
                    slip.distance * slide.progress(t)
                })
                .sum(),
            Kind::Peel | Kind::Swing => 0.0,
        }
    }
}
