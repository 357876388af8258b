//! The names of what a foot does in a stride.

/// What a foot is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// It stands.
    Standing,
    /// It peels off the ground, heel first, with what load is left.
    Peeling,
    /// It is in the air.
    Swinging,
    /// It has touched down and not yet come to rest.
    Landing,
    /// It slides under load.
    Slipping,
}
