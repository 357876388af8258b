//! Reasons to doubt an estimate.

/// A reason to doubt an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flag {
    /// Fewer samples than the window's length have been used. The means cover the samples so far. Samples before up is
    /// known are not used, so that the flag stays with [`Self::AttitudeNotInitialised`].
    WindowNotFull,
    /// The attitude filter has not found up yet, or has lost it in a gap, so gravity cannot be removed. Every
    /// probability is 0.
    AttitudeNotInitialised,
    /// The newest sample is at the end of the sensor's range: it counts as mass 0, and its probabilities are 0.
    Saturated,
    /// The newest sample repeats an earlier one: it counts as mass 0, and its probabilities are 0.
    Stale,
    /// The newest sample is not finite, beyond any sensor's range, or not later than the one
    /// before: it counts as mass 0, and its probabilities are 0.
    InvalidSample,
    /// At least one sample is missing before this one. With half-widths, missing samples count as mass 0. Otherwise a
    /// gap of up to half a window is bridged, with a probability no higher than before it; a longer gap reduces the
    /// probability, to almost 0 within three windows.
    TimeGap,
    /// The foot has not yet shown enough stillness and motion, so the limits between them
    /// are still mostly those that fit all feet. Walking a few steps clears this flag.
    Settling,
    /// The foot moves as little as in a stance, but has neither rested nor landed for longer than a stride, so it may
    /// hang, or be carried. The probability is at most one half.
    Unproven,
}

impl Flag {
    /// All flags, in the order of their bits.
    pub const ALL: [Self; 8] = [
        Self::WindowNotFull,
        Self::AttitudeNotInitialised,
        Self::Saturated,
        Self::Stale,
        Self::InvalidSample,
        Self::TimeGap,
        Self::Settling,
        Self::Unproven,
    ];

    /// The flag's name as written in files: `window_not_full` and so on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::WindowNotFull => "window_not_full",
            Self::AttitudeNotInitialised => "attitude_not_initialised",
            Self::Saturated => "saturated",
            Self::Stale => "stale",
            Self::InvalidSample => "invalid_sample",
            Self::TimeGap => "time_gap",
            Self::Settling => "settling",
            Self::Unproven => "unproven",
        }
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A set of [`Flag`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Flags(u8);

impl Flags {
    /// No reason for doubt.
    pub const NONE: Self = Self(0);

    /// Returns this set with `flag` added.
    #[must_use]
    pub const fn with(self, flag: Flag) -> Self {
        Self(self.0 | flag.bit())
    }

    /// Returns whether `flag` is in the set.
    #[must_use]
    pub const fn contains(self, flag: Flag) -> bool {
        self.0 & flag.bit() != 0
    }

    /// Returns whether the data are in doubt, so that the decision must not be "stable".
    ///
    /// True for any flag but two: the missing samples of a [`Flag::TimeGap`] have already been accounted for, and a
    /// foot that is [`Flag::Settling`], since it has never walked, may stand.
    #[must_use]
    pub const fn are_doubt(self) -> bool {
        self.0 & !(Flag::TimeGap.bit() | Flag::Settling.bit()) != 0
    }

    /// Returns whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Iterates over the flags in the set, in the order of their bits.
    pub fn iter(self) -> impl Iterator<Item = Flag> {
        Flag::ALL.into_iter().filter(move |flag| self.contains(*flag))
    }

    /// Creates the set of these bits, as of [`bits`](Self::bits).
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// The set as bits: bit *i* stands for `Flag::ALL[i]`.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_holds_the_flags_put_into_it_and_no_others() {
        let set = Flags::NONE.with(Flag::Saturated).with(Flag::TimeGap);
        assert!(set.iter().eq([Flag::Saturated, Flag::TimeGap]));
        assert!(!set.contains(Flag::Stale) && !set.is_empty());
    }

    #[test]
    fn every_flag_has_its_own_bit_at_its_place_in_the_list() {
        for (i, flag) in Flag::ALL.into_iter().enumerate() {
            assert_eq!(Flags::NONE.with(flag).bits(), 1 << i);
        }
    }

    #[test]
    fn flags_of_bits_are_those_that_were_joined() {
        for flag in Flag::ALL {
            let flags = Flags::NONE.with(flag).with(Flag::Saturated);
            assert_eq!(Flags::from_bits(flags.bits()), flags);
        }
    }
}
