//! The sensor's digital low-pass filter.

/// A Butterworth filter of second order: maximally flat, −3 dB at the cutoff, and 11 % more noise
/// bandwidth than a brick wall at that cutoff.
///
/// ST gives the cutoffs of the LSM6DSOX's filters, not their order or shape; this is the simplest
/// one that has the right cutoff and a plausible delay (0.7 ms at 335 Hz).
#[derive(Clone, Copy, Debug)]
pub(super) struct LowPass {
    b: f64,
    a1: f64,
    a2: f64,
    state: Option<[f64; 2]>,
}

impl LowPass {
    /// For samples at `rate`, both in Hz; the cutoff lies below half of it. By the bilinear
    /// transform, with the cutoff put where it belongs.
    pub fn new(cutoff: f64, rate: f64) -> Self {
        let k = libm::tan(std::f64::consts::PI * cutoff / rate);
        let norm = 1.0 / (1.0 + std::f64::consts::SQRT_2 * k + k * k);
        Self {
            b: k * k * norm,
            a1: 2.0 * (k * k - 1.0) * norm,
            a2: (1.0 - std::f64::consts::SQRT_2 * k + k * k) * norm,
            state: None,
        }
    }

    /// The output for the next input. The first input is taken for one that has been there for
    /// ever, so that a recording does not begin with the filter's start-up.
    pub fn push(&mut self, input: f64) -> f64 {
        let settled = [input * (1.0 - self.b), input * (self.b - self.a2)];
        let [s1, s2] = self.state.unwrap_or(settled);
        let scaled = self.b * input;
        let output = scaled + s1;
        self.state = Some([
            2.0 * scaled - self.a1 * output + s2,
            scaled - self.a2 * output,
        ]);
        output
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 20_000.0 / 3.0;

    /// Amplitude of the response to a sine of amplitude 1.
    fn gain(frequency: f64) -> f64 {
        let mut filter = LowPass::new(335.0, RATE);
        let response = (0..20_000).map(|k| {
            filter.push(libm::sin(
                std::f64::consts::TAU * frequency * f64::from(k) / RATE,
            ))
        });
        response.skip(10_000).fold(0.0, f64::max)
    }

    #[test]
    fn the_gain_is_one_half_of_the_power_at_the_cutoff() {
        assert!((gain(20.0) - 1.0).abs() < 1e-3);
        assert!((gain(335.0) - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-3);
        assert!(gain(1000.0) < 0.12);
    }

    #[test]
    fn a_constant_passes_from_the_first_sample_on() {
        let mut filter = LowPass::new(335.0, RATE);
        for _ in 0..100 {
            assert!((filter.push(9.81) - 9.81).abs() < 1e-12);
        }
    }
}
