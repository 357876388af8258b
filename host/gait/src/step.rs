//! Numbers of one step, from lift-off to the next lift-off; a plan is a list of steps.
//!
//! Every number can be set by hand, for a grid of slips or of landings.

/// A swing and the stance after it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedStep {
    /// Duration of the peel off the ground, s.
    pub peel: f64,
    /// Time in the air, s.
    pub swing: f64,
    /// Time from touch-down to the beginning of the next peel, s; extended to the end of the last slip.
    pub stance: f64,
    /// Forward (x) and to the left (y), m, from where the foot stood to where it lands.
    pub travel: [f64; 2],
    /// Height of the swing above a straight line, m.
    pub clearance: f64,
    /// Amplitude of the pitch swing, rad: toes down first, then up.
    pub pitch_swing: f64,
    /// Roll, pitch and yaw of the ground at the foothold, rad.
    pub tilt: [f64; 3],
    /// The landing.
    pub touch_down: TouchDown,
    /// Yielding of the ground, if any.
    pub sinking: Option<Sinking>,
    /// Slides during the stance, in order of time.
    pub slips: Vec<Slip>,
    /// Vibration of the standing foot under the moving robot.
    pub tremor: Tremor,
    /// Vertical load in mid-stance, N.
    pub load: f64,
    /// Time in which the load builds up, and in which it decreases before lift-off, s.
    pub load_change: f64,
}

/// Damped spring, as of a landing foot against the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio, in (0, 1).
    pub damping: f64,
}

/// Landing of a foot: its remaining speeds, and the springs that absorb them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchDown {
    /// Downward, m/s.
    pub speed: f64,
    /// Forward (x) and to the left (y), m/s.
    pub scuff: [f64; 2],
    /// Rates of roll and pitch, rad/s.
    pub turn: [f64; 2],
    /// Absorbs `speed`. At a damping of 0.3 the deceleration peaks at about 2π · frequency · speed.
    pub vertical: Spring,
    /// Absorbs `scuff`.
    pub tangential: Spring,
    /// Absorbs `turn`.
    pub rotational: Spring,
}

/// A slow yielding of soft ground under the load, after touch-down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sinking {
    /// m.
    pub depth: f64,
    /// s.
    pub duration: f64,
    /// Change of roll and pitch meanwhile, rad.
    pub lean: [f64; 2],
}

/// A slide under load: it starts from rest, speeds up, and is caught again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Time from touch-down, s.
    pub onset: f64,
    /// s. The top speed is 1.875 · distance / duration.
    pub duration: f64,
    /// m.
    pub distance: f64,
    /// Counter-clockwise from forward, rad: π slides backwards.
    pub heading: f64,
    /// Turn about the vertical meanwhile, rad.
    pub twist: f64,
    /// Acceleration amplitude of stick-slip along the slide at half-time, m/s². A third of it
    /// acts vertically.
    pub chatter: f64,
    /// Frequency of stick-slip, Hz.
    pub chatter_frequency: f64,
}

/// Vibration of a foot standing under a moving robot, strongest in mid-stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tremor {
    /// Hz.
    pub frequency: f64,
    /// Amplitude along each axis, m/s².
    pub acceleration: f64,
    /// Amplitude of pitch and roll rate, rad/s.
    pub rate: f64,
}

impl PlannedStep {
    /// Returns the time from touch-down to the beginning of the next peel, s, including all slips.
    #[must_use]
    pub fn standing(&self) -> f64 {
        let slips = self.slips.iter().map(|slip| slip.onset + slip.duration);
        slips.fold(self.stance, f64::max)
    }

    /// Returns the time from the beginning of the peel to the next one, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.peel + self.swing + self.standing()
    }
}
