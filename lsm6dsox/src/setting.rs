//! Choices of settings: data rates, filters and pins.

/// Output data rate, by ST's nominal numbers \[P\]. The part's own clock may be off by some per cent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Odr {
    /// Powered down.
    #[default]
    Off,
    /// 1.6 Hz; the accelerometer only, in its low-power mode.
    Hz1_6,
    /// 12.5 Hz.
    Hz12_5,
    /// 26 Hz.
    Hz26,
    /// 52 Hz.
    Hz52,
    /// 104 Hz.
    Hz104,
    /// 208 Hz.
    Hz208,
    /// 417 Hz.
    Hz417,
    /// 833 Hz.
    Hz833,
    /// 1667 Hz.
    Hz1667,
    /// 3333 Hz.
    Hz3333,
    /// 6667 Hz.
    Hz6667,
}

impl Odr {
    /// All data rates, slowest first.
    pub const ALL: [Self; 12] = [
        Self::Off,
        Self::Hz1_6,
        Self::Hz12_5,
        Self::Hz26,
        Self::Hz52,
        Self::Hz104,
        Self::Hz208,
        Self::Hz417,
        Self::Hz833,
        Self::Hz1667,
        Self::Hz3333,
        Self::Hz6667,
    ];

    /// Nominal rate, Hz.
    #[must_use]
    pub const fn hertz(self) -> f32 {
        match self {
            Self::Off => 0.0,
            Self::Hz1_6 => 1.6,
            Self::Hz12_5 => 12.5,
            Self::Hz26 => 26.0,
            Self::Hz52 => 52.0,
            Self::Hz104 => 104.0,
            Self::Hz208 => 208.0,
            Self::Hz417 => 417.0,
            Self::Hz833 => 833.0,
            Self::Hz1667 => 1667.0,
            Self::Hz3333 => 3333.0,
            Self::Hz6667 => 6667.0,
        }
    }

    /// Code in `ODR_XL`, `ODR_G`, `BDR_XL` and `BDR_GY`.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Off => 0,
            Self::Hz12_5 => 1,
            Self::Hz26 => 2,
            Self::Hz52 => 3,
            Self::Hz104 => 4,
            Self::Hz208 => 5,
            Self::Hz417 => 6,
            Self::Hz833 => 7,
            Self::Hz1667 => 8,
            Self::Hz3333 => 9,
            Self::Hz6667 => 10,
            Self::Hz1_6 => 11,
        }
    }

    pub(crate) const fn is_off(self) -> bool {
        matches!(self, Self::Off)
    }
}

/// The accelerometer's low-pass filter, by its cut-off \[D\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelFilter {
    /// LPF1 alone: ODR/2.
    #[default]
    OdrDiv2,
    /// LPF2 at ODR/4.
    OdrDiv4,
    /// LPF2 at ODR/10.
    OdrDiv10,
    /// LPF2 at ODR/20.
    OdrDiv20,
    /// LPF2 at ODR/45.
    OdrDiv45,
    /// LPF2 at ODR/100.
    OdrDiv100,
    /// LPF2 at ODR/200.
    OdrDiv200,
    /// LPF2 at ODR/400.
    OdrDiv400,
    /// LPF2 at ODR/800.
    OdrDiv800,
}

impl AccelFilter {
    /// All filters, widest first.
    pub const ALL: [Self; 9] = [
        Self::OdrDiv2,
        Self::OdrDiv4,
        Self::OdrDiv10,
        Self::OdrDiv20,
        Self::OdrDiv45,
        Self::OdrDiv100,
        Self::OdrDiv200,
        Self::OdrDiv400,
        Self::OdrDiv800,
    ];

    /// Ratio of data rate and cut-off.
    #[must_use]
    pub const fn divisor(self) -> f32 {
        match self {
            Self::OdrDiv2 => 2.0,
            Self::OdrDiv4 => 4.0,
            Self::OdrDiv10 => 10.0,
            Self::OdrDiv20 => 20.0,
            Self::OdrDiv45 => 45.0,
            Self::OdrDiv100 => 100.0,
            Self::OdrDiv200 => 200.0,
            Self::OdrDiv400 => 400.0,
            Self::OdrDiv800 => 800.0,
        }
    }

    /// Code in `HPCF_XL` \[P\]; 0 with LPF2 on is ODR/4 \[D\].
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::OdrDiv2 | Self::OdrDiv4 => 0,
            Self::OdrDiv10 => 1,
            Self::OdrDiv20 => 2,
            Self::OdrDiv45 => 3,
            Self::OdrDiv100 => 4,
            Self::OdrDiv200 => 5,
            Self::OdrDiv400 => 6,
            Self::OdrDiv800 => 7,
        }
    }

    pub(crate) const fn uses_lpf2(self) -> bool {
        !matches!(self, Self::OdrDiv2)
    }
}

/// FTYPE: cut-off of the gyroscope's LPF1. The resulting frequency depends on the data rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ftype {
    /// 000: 335 Hz at 6667 Hz.
    #[default]
    F0,
    /// 001: 232 Hz at 6667 Hz.
    F1,
    /// 010: 171 Hz at 6667 Hz.
    F2,
    /// 011: 609 Hz at 6667 Hz.
    F3,
    /// 100: 100.6 Hz at 6667 Hz.
    F4,
    /// 101: 49.9 Hz at 6667 Hz.
    F5,
    /// 110: 25.1 Hz at 6667 Hz.
    F6,
    /// 111: 12.5 Hz at 6667 Hz.
    F7,
}

impl Ftype {
    /// All values, by code.
    pub const ALL: [Self; 8] =
        [Self::F0, Self::F1, Self::F2, Self::F3, Self::F4, Self::F5, Self::F6, Self::F7];

    /// Cut-off at a data rate of 6667 Hz, Hz \[D\].
    #[must_use]
    const fn cutoff_at_6667_hz(self) -> f32 {
        match self {
            Self::F0 => 335.0,
            Self::F1 => 232.0,
            Self::F2 => 171.0,
            Self::F3 => 609.0,
            Self::F4 => 100.6,
            Self::F5 => 49.9,
            Self::F6 => 25.1,
            Self::F7 => 12.5,
        }
    }

    /// Code in FTYPE.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// The gyroscope's low-pass filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GyroFilter {
    /// LPF2 alone, fixed by the data rate.
    Lpf2,
    /// LPF1 before LPF2.
    Lpf1(Ftype),
}

impl GyroFilter {
    /// Cut-off at a data rate, Hz \[D\]; `None` if it is unknown.
    #[must_use]
    pub const fn cutoff(self, odr: Odr) -> Option<f32> {
        match (self, odr) {
            (Self::Lpf1(ftype), Odr::Hz6667) => Some(ftype.cutoff_at_6667_hz()),
            (Self::Lpf2, Odr::Hz833) => Some(295.0),
            (Self::Lpf2, Odr::Hz1667) => Some(1108.0),
            (Self::Lpf2, Odr::Hz6667) => Some(1442.0),
            _ => None,
        }
    }
}

/// One of the two sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Specific force.
    Accel,
    /// Angular rate.
    Gyro,
}

/// One of the two interrupt pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pin {
    /// INT1. A high level at power-up leaves only I3C enabled, so it must not have a pull-up.
    Int1,
    /// INT2.
    Int2,
}

/// Duration for which the data-ready pin stays high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataReadyMode {
    /// Until a high byte of the sample is read.
    Latched,
    /// 75 µs \[D\].
    Pulsed,
}
