//! Time between consecutive samples, and its suitability for integration.

/// Time between consecutive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Seconds; after an interruption, one period.
    pub(crate) seconds: f32,
    pub(crate) continuity: Continuity,
}

/// Continuity between two consecutive samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// Close enough to integrate between them.
    Continuous,
    /// Too far apart for more than an estimate of the integral.
    Gap,
    /// Too far apart for any assumption about the motion in between.
    Interrupted,
}
