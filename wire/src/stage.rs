//! Stages of the board.

/// Stage of the board, as reported in health messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Finding and configuring the sensor.
    #[default]
    Starting,
    /// Running the sensor's self-test.
    SelfTest,
    /// Finding up: the foot must be held still.
    HoldStill,
    /// Estimating.
    Running,
    /// The sensor has failed and is being initialised again.
    Recovering,
}

impl Stage {
    /// All stages, in the order of their codes, from 0.
    pub const ALL: [Self; 5] =
        [Self::Starting, Self::SelfTest, Self::HoldStill, Self::Running, Self::Recovering];

    /// The stage's name as written in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::SelfTest => "self_test",
            Self::HoldStill => "hold_still",
            Self::Running => "running",
            Self::Recovering => "recovering",
        }
    }

    /// The stage's code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The stage with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_have_unique_codes_and_names() {
        for (code, stage) in (0..).zip(Stage::ALL) {
            assert_eq!(stage.code(), code);
            assert_eq!(Stage::from_code(code), Some(stage));
            let same = Stage::ALL.into_iter().filter(|s| s.name() == stage.name());
            assert_eq!(same.count(), 1, "{stage:?}");
        }
        assert_eq!(Stage::from_code(Stage::ALL.len() as u8), None);
    }
}
