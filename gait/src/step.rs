//! One step, from lift-off to the next lift-off, as numbers: what a plan is a list of.
//!
//! Everything here can be set by hand, to lay out a grid of slips or of landings.

/// A swing and the stance after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// How long the foot peels off the ground before it is free, s.
    pub peel: f64,
    /// How long the foot is in the air, s.
    pub swing: f64,
    /// From touch-down to the beginning of the next peel, s. It lasts longer where the last slip
    /// does.
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
    /// Where the ground gives way.
    pub sinking: Option<Sinking>,
    /// Slides during the stance, in order of time.
    pub slips: Vec<Slip>,
    /// What the moving robot passes on to the standing foot.
    pub tremor: Tremor,
    /// Vertical load in mid-stance, N.
    pub load: f64,
    /// How long the load takes to build up, and to go again before lift-off, s.
    pub load_change: f64,
}

/// A damped spring, as the foot is one against the ground when it lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio, in (0, 1).
    pub damping: f64,
}

/// How a foot meets the ground: the speeds it still has, and the springs that take them up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchDown {
    /// Downward, m/s.
    pub speed: f64,
    /// Forward (x) and to the left (y), m/s.
    pub scuff: [f64; 2],
    /// Of roll and pitch, rad/s.
    pub turn: [f64; 2],
    /// Takes up `speed`. At a damping of 0.3 the deceleration peaks at about 2π · frequency ·
    /// speed.
    pub vertical: Spring,
    /// Takes up `scuff`.
    pub tangential: Spring,
    /// Takes up `turn`.
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
    /// From touch-down, s.
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
    /// Of stick-slip, Hz.
    pub chatter_frequency: f64,
}

/// The vibration of a foot that stands under a moving robot, strongest in mid-stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tremor {
    /// Hz.
    pub frequency: f64,
    /// Amplitude along each axis, m/s².
    pub acceleration: f64,
    /// Amplitude of pitch and roll rate, rad/s.
    pub rate: f64,
}

impl Step {
    /// From touch-down to the beginning of the next peel, s, with all slips inside.
    #[must_use]
    pub fn standing(&self) -> f64 {
        let slips = self.slips.iter().map(|slip| slip.onset + slip.duration);
        slips.fold(self.stance, f64::max)
    }

    /// From the beginning of the peel to the next one, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.peel + self.swing + self.standing()
    }
}
