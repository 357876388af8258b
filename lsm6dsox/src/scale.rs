//! Scale of the codes: full scales, sensitivities, and the only conversion to SI units.

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f32 = 9.806_65;

/// One degree in radians.
pub const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// Largest specific force the accelerometer measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelFullScale {
    /// ±2 g.
    #[default]
    G2,
    /// ±4 g.
    G4,
    /// ±8 g.
    G8,
    /// ±16 g.
    G16,
}

/// Largest angular rate the gyroscope measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GyroFullScale {
    /// ±125 °/s.
    Dps125,
    /// ±250 °/s.
    #[default]
    Dps250,
    /// ±500 °/s.
    Dps500,
    /// ±1000 °/s.
    Dps1000,
    /// ±2000 °/s.
    Dps2000,
}

/// A full scale, which defines the value of a code.
pub trait FullScale: Copy {
    /// SI units per code.
    fn sensitivity(self) -> f32;

    /// Smallest magnitude of a code that counts as saturated.
    fn limit(self) -> u16;
}

impl AccelFullScale {
    /// All full scales, smallest first.
    pub const ALL: [Self; 4] = [Self::G2, Self::G4, Self::G8, Self::G16];

    /// Sensitivity, mg per code \[P\].
    #[must_use]
    pub const fn milli_g_per_code(self) -> f32 {
        match self {
            Self::G2 => 0.061,
            Self::G4 => 0.122,
            Self::G8 => 0.244,
            Self::G16 => 0.488,
        }
    }

    /// Code in `FS_XL`; 01 is the largest, not the second \[P\].
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::G2 => 0b00,
            Self::G16 => 0b01,
            Self::G4 => 0b10,
            Self::G8 => 0b11,
        }
    }
}

impl FullScale for AccelFullScale {
    fn sensitivity(self) -> f32 {
        self.milli_g_per_code() * 1.0e-3 * STANDARD_GRAVITY
    }

    /// The end of the 16-bit range, which is just below the nominal full scale.
    fn limit(self) -> u16 {
        i16::MAX.unsigned_abs()
    }
}

impl GyroFullScale {
    /// All full scales, smallest first.
    pub const ALL: [Self; 5] =
        [Self::Dps125, Self::Dps250, Self::Dps500, Self::Dps1000, Self::Dps2000];

    /// Sensitivity, m°/s per code \[P\].
    #[must_use]
    pub const fn milli_dps_per_code(self) -> f32 {
        match self {
            Self::Dps125 => 4.375,
            Self::Dps250 => 8.75,
            Self::Dps500 => 17.5,
            Self::Dps1000 => 35.0,
            Self::Dps2000 => 70.0,
        }
    }

    /// Code in `FS_G` \[P\].
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Dps125 | Self::Dps250 => 0b00,
            Self::Dps500 => 0b01,
            Self::Dps1000 => 0b10,
            Self::Dps2000 => 0b11,
        }
    }
}

impl FullScale for GyroFullScale {
    fn sensitivity(self) -> f32 {
        self.milli_dps_per_code() * 1.0e-3 * DEGREE
    }

    /// The nominal full scale, 125 °/s / 4.375 m°/s and its multiples. The part does output codes beyond it, up to the
    /// end of the 16-bit range. ST states that they are clipped and meaningless (ST community, *Valid range (Full
    /// Scale) for the gyroscope (LSM6DSOX)*, 2025) \[S\].
    fn limit(self) -> u16 {
        28_571
    }
}

/// Three codes of one sensor, x, y and z, with their scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Codes<S> {
    /// Codes as read from the part.
    pub codes: [i16; 3],
    /// Full scale of the codes.
    pub full_scale: S,
}

impl<S: FullScale> Codes<S> {
    /// Converts to SI units: m/s² or rad/s.
    #[must_use]
    pub fn to_si(&self) -> [f32; 3] {
        let sensitivity = self.full_scale.sensitivity();
        let [x, y, z] = self.codes;
        [f32::from(x) * sensitivity, f32::from(y) * sensitivity, f32::from(z) * sensitivity]
    }

    /// Returns per axis whether the code is at or beyond the end of the range, so that the true value is further out.
    #[must_use]
    pub fn saturated(&self) -> [bool; 3] {
        let limit = self.full_scale.limit();
        let [x, y, z] = self.codes;
        [x.unsigned_abs() >= limit, y.unsigned_abs() >= limit, z.unsigned_abs() >= limit]
    }

    /// Returns whether any axis is beyond 90 % of the full scale.
    #[must_use]
    pub fn is_near_full_scale(&self) -> bool {
        let limit = self.full_scale.limit() / 10 * 9;
        self.codes.iter().any(|code| code.unsigned_abs() > limit)
    }

    /// Returns whether any axis is saturated.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        let limit = self.full_scale.limit();
        let [x, y, z] = self.codes;
        x.unsigned_abs() >= limit || y.unsigned_abs() >= limit || z.unsigned_abs() >= limit
    }
}

/// A temperature in the part's codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TemperatureCode(pub i16);

impl TemperatureCode {
    /// Converts to °C: 256 codes per degree, 0 is 25 °C \[P, D\].
    #[must_use]
    pub fn to_celsius(self) -> f32 {
        f32::from(self.0) / 256.0 + 25.0
    }
}

/// `INTERNAL_FREQ_FINE`: error of the part's clock, as measured in production;
/// steps of 0.15 % \[D; P of a sibling\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrequencyFine(pub i8);

impl FrequencyFine {
    /// Ratio of the part's rate to the nominal one.
    #[must_use]
    pub fn ratio(self) -> f64 {
        1.0 + 0.0015 * f64::from(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_g_is_9_81_m_s2_at_every_full_scale() {
        for full_scale in AccelFullScale::ALL {
            let code = (1000.0 / full_scale.milli_g_per_code()) as i16;
            let codes = Codes { codes: [0, -code, code], full_scale };
            let [x, y, z] = codes.to_si();
            assert_eq!(x, 0.0);
            assert!((z - 9.807).abs() < 0.01 && y == -z, "{full_scale:?}: {z}");
        }
    }

    #[test]
    fn hundred_dps_is_1_745_rad_s_at_every_full_scale() {
        for full_scale in GyroFullScale::ALL {
            let code = (100_000.0 / full_scale.milli_dps_per_code()) as i16;
            let codes = Codes { codes: [code; 3], full_scale };
            assert!((codes.to_si()[0] - 1.7453).abs() < 0.002, "{full_scale:?}");
        }
    }

    #[test]
    fn only_the_last_code_of_either_sign_is_saturated() {
        let codes = |codes| Codes { codes, full_scale: AccelFullScale::G16 };
        assert_eq!(codes([i16::MAX, -i16::MAX, i16::MIN]).saturated(), [true; 3]);
        assert!(!codes([i16::MAX - 1, 1 - i16::MAX, 0]).is_saturated());
    }

    #[test]
    fn a_gyroscope_is_saturated_from_its_nominal_full_scale_on() {
        for (full_scale, dps) in
            GyroFullScale::ALL.into_iter().zip([125.0, 250.0, 500.0, 1000.0, 2000.0])
        {
            assert_eq!((dps * 1000.0 / full_scale.milli_dps_per_code()) as u16, full_scale.limit());
        }
        let codes = |code| Codes { codes: [0, code, 0], full_scale: GyroFullScale::Dps2000 };
        assert!(codes(28_571).is_saturated() && codes(-28_571).is_saturated());
        assert!(!codes(28_570).is_saturated());
    }

    #[test]
    fn a_step_of_the_trim_is_0_15_per_cent() {
        assert_eq!(FrequencyFine(0).ratio(), 1.0);
        assert_eq!(FrequencyFine(-10).ratio(), 0.985);
    }

    #[test]
    fn zero_is_25_degrees_celsius() {
        assert_eq!(TemperatureCode(0).to_celsius(), 25.0);
        assert_eq!(TemperatureCode(-25 * 256).to_celsius(), 0.0);
        assert_eq!(TemperatureCode(128).to_celsius(), 25.5);
    }
}
