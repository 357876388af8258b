//! Costs of the running program, which the board measures: the largest since the start.

use core::sync::atomic::{AtomicU16, Ordering};

/// A cost. The times are those of ticks with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Time from the data-ready edge to the contact in its mailbox, µs.
    Mailbox,
    /// Time from the data-ready edge to the end of the tick's work, µs.
    Work,
    /// Depth of the stack, bytes.
    Stack,
}

/// Largest value of each cost.
#[derive(Debug, Default)]
pub struct Costs([AtomicU16; 3]);

impl Costs {
    pub(crate) const fn new() -> Self {
        Self([const { AtomicU16::new(0) }; 3])
    }

    /// Takes a value, at most 65 535.
    pub fn take(&self, cost: Cost, value: u32) {
        let value = value.min(u32::from(u16::MAX)) as u16;
        if let Some(largest) = self.0.get(cost as usize)
            && value > largest.load(Ordering::Relaxed)
        {
            largest.store(value, Ordering::Relaxed);
        }
    }

    /// Largest values so far, in the order of [`Cost`].
    pub fn largest(&self) -> [u16; 3] {
        self.0.each_ref().map(|value| value.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_keep_their_largest_value() {
        let costs = Costs::new();
        for (cost, value) in [
            (Cost::Mailbox, 75),
            (Cost::Mailbox, 74),
            (Cost::Stack, 1_000_000),
            (Cost::Work, 120),
            (Cost::Work, 121),
        ] {
            costs.take(cost, value);
        }
        assert_eq!(costs.largest(), [75, 121, u16::MAX]);
    }
}
