//! Errors, as the numbers and texts of the header.

use core::ffi::CStr;

/// Reason why a call was rejected; 0 means success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Error {
    /// A required pointer is NULL.
    Null = 1,
    /// A pointer is not aligned.
    Misaligned,
    /// The memory is smaller than the estimator.
    TooSmall,
    /// The memory holds no estimator.
    NotInitialised,
    /// A field holds a number other than its constants.
    Choice,
    /// The sample rate is out of range.
    SampleRate,
    /// A number of the decision is out of range.
    Decision,
    /// A threshold of the load is out of range.
    Load,
    /// A number of the zero-velocity measurement is out of range.
    Velocity,
    /// The state learnt before is damaged, of another version, or out of range.
    Learnt,
    /// A batch has too many samples.
    Count,
    /// The readings of the accelerometer have another unit.
    Unit,
}

impl Error {
    /// All errors, in the order of their numbers, from 1.
    pub const ALL: [Self; 12] = [
        Self::Null,
        Self::Misaligned,
        Self::TooSmall,
        Self::NotInitialised,
        Self::Choice,
        Self::SampleRate,
        Self::Decision,
        Self::Load,
        Self::Velocity,
        Self::Learnt,
        Self::Count,
        Self::Unit,
    ];

    /// Text for a log.
    #[must_use]
    pub const fn text(self) -> &'static CStr {
        match self {
            Self::Null => c"a required pointer is NULL",
            Self::Misaligned => c"a pointer is not aligned to its type",
            Self::TooSmall => c"the memory is smaller than footfall_estimator_size()",
            Self::NotInitialised => c"the memory holds no initialised estimator",
            Self::Choice => c"a field holds none of its constants",
            Self::SampleRate => c"sample_rate_hz is out of range: 20 to 10000 Hz",
            Self::Decision => {
                c"decision is out of range: threshold in 0.01 to 0.99, on_delay 0 to 10 s, off_delay 0 to 0.2 s"
            }
            Self::Load => c"load is out of range: both within 1e9, off not above on",
            Self::Velocity => c"velocity is out of range: speed 0.001 to 10 m/s, lever 0 to 10 m, floor 0.0001 to 1 m/s",
            Self::Learnt => c"learnt is damaged, of another version, or not from footfall_estimator_learnt(): start without it",
            Self::Count => c"a batch has more than FOOTFALL_MOST_SAMPLES samples",
            Self::Unit => c"the mean force is not gravity, 9.8 m/s^2: multiply readings in g by 9.80665, in mg by 0.00980665, or correct the full scale or the scale",
        }
    }
}

/// Text of an error's number.
#[must_use]
pub fn text(number: i32) -> &'static CStr {
    if number == 0 {
        return c"no error";
    }
    let error = Error::ALL.into_iter().find(|error| *error as i32 == number);
    error.map_or(c"unknown error", Error::text)
}
