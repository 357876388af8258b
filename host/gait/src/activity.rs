//! Activities of a foot in a stride.

/// Activity of a foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Standing on the ground.
    Standing,
    /// Peeling off the ground, heel first, under the remaining load.
    Peeling,
    /// In the air.
    Swinging,
    /// Touched down, but not yet at rest.
    Landing,
    /// Sliding under load.
    Slipping,
}
