//! The paper's formula in f64, written from the page: slow, plain, and without code in common with the estimator.
//!
//! ```text
//! P_i = (1/n) Σ_k ½ [erf((δ_i − m_k)/(h_i√2)) + erf((δ_i + m_k)/(h_i√2))]
//! ```
//!
//! over the last n samples, or over fewer at the start, and the products of axes. The error function is that of
//! the `libm` crate in f64.

/// The three products of the paper, as given by the formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleProbabilities {
    /// P(ax)·P(ay)·P(ωz).
    pub tangential: f64,
    /// P(az)·P(ωx)·P(ωy).
    pub vertical: f64,
    /// The product over all axes.
    pub stable: f64,
}

/// Bandwidths h, half-widths δ and the window n; axes in the order ax, ay, az, ωx, ωy, ωz.
#[derive(Clone, Copy, Debug)]
pub struct Oracle {
    /// h per axis, in the unit of the axis.
    pub bandwidth: [f64; 6],
    /// δ per axis, in the unit of the axis.
    pub half_width: [f64; 6],
    /// n, samples.
    pub window: usize,
}

impl Oracle {
    /// Probabilities after the last of `history`, a sequence of samples with six axes each.
    ///
    /// # Panics
    /// If `history` is empty.
    #[must_use]
    pub fn probabilities(&self, history: &[[f64; 6]]) -> OracleProbabilities {
        assert!(!history.is_empty(), "the formula needs a sample");
        let window = &history[history.len().saturating_sub(self.window)..];
        let axis = |i: usize| {
            let sum: f64 = window.iter().map(|sample| self.mass(i, sample[i])).sum();
            sum / window.len() as f64
        };
        let [ax, ay, az, wx, wy, wz] = std::array::from_fn(axis);
        OracleProbabilities {
            tangential: ax * ay * wz,
            vertical: az * wx * wy,
            stable: ax * ay * az * wx * wy * wz,
        }
    }

    fn mass(&self, i: usize, m: f64) -> f64 {
        let scale = self.bandwidth[i] * std::f64::consts::SQRT_2;
        let (above, below) = (self.half_width[i] - m, self.half_width[i] + m);
        0.5 * (libm::erf(above / scale) + libm::erf(below / scale))
    }
}
