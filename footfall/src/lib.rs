//! footfall on the host: recordings in, probabilities, numbers and pictures out.

pub mod gait;
pub mod recording;
