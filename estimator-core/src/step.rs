//! The time from one sample to the next, and how far it can be integrated over.

/// The time from one sample to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Seconds; after an interruption, one period.
    pub(crate) seconds: f32,
    pub(crate) continuity: Continuity,
}

/// How closely one sample followed the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// Closely enough to integrate between them.
    Continuous,
    /// So that the integral is no more than a guess.
    Gap,
    /// After a time in which anything may have happened.
    Interrupted,
}
