//! Fields of a frame as a DBC describes them.

/// Interpretation of a signal's bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Unsigned, times `factor`.
    Unsigned {
        /// The physical value of one step.
        factor: f64,
    },
    /// Two's complement, times `factor`; the most negative code means "no value".
    Signed {
        /// The physical value of one step.
        factor: f64,
    },
    /// Unsigned, with names for its values.
    Named(&'static [(u8, &'static str)]),
}

/// Field of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name in the DBC.
    pub name: &'static str,
    /// Lowest bit in the frame; bit 8 is the lowest of byte 1. 0 in a [`Field`](super::Field),
    /// whose signals follow each other.
    pub start: u8,
    /// Length, bits.
    pub length: u8,
    /// Interpretation of the bits.
    pub kind: Kind,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Description.
    pub comment: &'static str,
}

impl Signal {
    pub(crate) const fn probability(name: &'static str, length: u8, comment: &'static str) -> Self {
        let factor = 1.0 / ((1_u32 << length) - 1) as f64;
        Self::unsigned(name, length, factor, "", comment)
    }

    pub(crate) const fn unsigned(
        name: &'static str,
        length: u8,
        factor: f64,
        unit: &'static str,
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length, kind: Kind::Unsigned { factor }, unit, comment }
    }

    pub(crate) const fn quantity(
        name: &'static str,
        factor: f64,
        unit: &'static str,
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length: 16, kind: Kind::Signed { factor }, unit, comment }
    }

    pub(crate) const fn named(
        name: &'static str,
        length: u8,
        names: &'static [(u8, &'static str)],
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length, kind: Kind::Named(names), unit: "", comment }
    }

    pub(crate) const fn flag(name: &'static str, comment: &'static str) -> Self {
        Self::named(name, 1, &[(0, "no"), (1, "yes")], comment)
    }

    /// Physical value of one step.
    #[must_use]
    pub const fn factor(&self) -> f64 {
        match self.kind {
            Kind::Unsigned { factor } | Kind::Signed { factor } => factor,
            Kind::Named(_) => 1.0,
        }
    }

    /// Minimum and maximum code that represent a value.
    #[must_use]
    pub const fn code_range(&self) -> (i64, i64) {
        match self.kind {
            Kind::Unsigned { .. } => (0, (1 << self.length) - 1),
            Kind::Signed { .. } => (-((1 << (self.length - 1)) - 1), (1 << (self.length - 1)) - 1),
            Kind::Named(names) => (0, names.len() as i64 - 1),
        }
    }
}

pub(super) const ACCELERATION_UNIT: &str = "m/s^2";
pub(super) const RATE_UNIT: &str = "rad/s";
