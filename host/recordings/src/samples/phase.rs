//! Codes of phases in messages, files and arrays: 0 unknown, 1 stance, 2 slip, 3 swing, 4 quiet swing, as in the frames of
//! a foot.

use estimator_core::Phase;

/// Returns the code of a phase: its place in [`Phase::ALL`].
#[must_use]
pub const fn code_of(phase: Phase) -> u8 {
    phase as u8
}

/// Returns the phase of a code; unknown for an invalid one.
#[must_use]
pub fn phase_of(code: u8) -> Phase {
    let phase = Phase::ALL.get(usize::from(code));
    phase.copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_places_among_all_phases() {
        for (place, phase) in Phase::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(code_of(phase)), place);
            assert_eq!(phase_of(code_of(phase)), phase);
        }
        assert_eq!(phase_of(5), Phase::Unknown);
        assert_eq!(phase_of(u8::MAX), Phase::Unknown);
    }
}
