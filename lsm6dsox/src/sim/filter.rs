//! A second-order Butterworth low-pass, by the bilinear transform with prewarping.

/// Coefficients of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LowPass {
    b0: f64,
    b1: f64,
    b2: f64,
    a1: f64,
    a2: f64,
}

/// State of the filter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    s1: f64,
    s2: f64,
}

impl LowPass {
    /// Passes everything.
    pub(super) const OPEN: Self = Self { b0: 1.0, b1: 0.0, b2: 0.0, a1: 0.0, a2: 0.0 };

    /// Creates a filter with its −3 dB point at `cutoff`; open if that is (nearly) half the rate or more.
    pub(super) fn new(cutoff: f64, rate: f64) -> Self {
        if cutoff >= 0.49 * rate {
            return Self::OPEN;
        }
        let k = libm::tan(core::f64::consts::PI * cutoff / rate);
        let norm = 1.0 / (1.0 + core::f64::consts::SQRT_2 * k + k * k);
        let b0 = k * k * norm;
        Self {
            b0,
            b1: 2.0 * b0,
            b2: b0,
            a1: 2.0 * (k * k - 1.0) * norm,
            a2: (1.0 - core::f64::consts::SQRT_2 * k + k * k) * norm,
        }
    }

    /// State in which a constant input passes unchanged.
    pub(super) const fn settled(&self, x: f64) -> State {
        State { s1: x * (1.0 - self.b0), s2: x * (self.b2 - self.a2) }
    }

    pub(super) const fn step(&self, state: &mut State, x: f64) -> f64 {
        let y = self.b0 * x + state.s1;
        state.s1 = self.b1 * x - self.a1 * y + state.s2;
        state.s2 = self.b2 * x - self.a2 * y;
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 6667.0;

    fn gain(cutoff: f64, frequency: f64) -> f64 {
        let filter = LowPass::new(cutoff, RATE);
        let mut state = State::default();
        let mut peak: f64 = 0.0;
        for i in 0..60_000 {
            let x = libm::sin(core::f64::consts::TAU * frequency * f64::from(i) / RATE);
            let y = filter.step(&mut state, x);
            if i > 30_000 {
                peak = peak.max(y.abs());
            }
        }
        peak
    }

    #[test]
    fn half_the_power_is_left_at_the_cut_off() {
        for cutoff in [12.5, 333.35, 335.0, 1442.0] {
            assert!(
                (gain(cutoff, cutoff) - core::f64::consts::FRAC_1_SQRT_2).abs() < 0.01,
                "{cutoff}"
            );
        }
    }

    #[test]
    fn aliasing_frequencies_are_damped_to_a_third_or_less() {
        // 667 Hz folds onto the cut-off itself: −12 dB.
        assert!(gain(335.0, 667.0) < 0.26);
        assert!(gain(335.0, 1000.0) < 0.12);
    }

    #[test]
    fn slow_motion_is_delayed_by_two_thirds_of_a_millisecond() {
        for cutoff in [333.35, 335.0] {
            let filter = LowPass::new(cutoff, RATE);
            let mut state = State::default();
            // A ramp of one unit per second, long after its start.
            let late = (0..10_000).fold(0.0, |_, i| {
                let x = f64::from(i) / RATE;
                x - filter.step(&mut state, x)
            });
            assert!((late - 0.67e-3).abs() < 0.005e-3, "{cutoff} Hz: {late} s");
        }
    }

    #[test]
    fn a_settled_filter_gives_back_a_constant() {
        let filter = LowPass::new(335.0, RATE);
        let mut state = filter.settled(123.0);
        for _ in 0..10 {
            assert!((filter.step(&mut state, 123.0) - 123.0).abs() < 1.0e-9);
        }
    }
}
