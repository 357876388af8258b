//! Reproducible random numbers.

/// xoshiro256++ of Blackman and Vigna (public domain), seeded by splitmix64.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: [u64; 4],
    spare: Option<f64>,
}

/// Hash of a counter by splitmix64.
pub(super) const fn hash(counter: u64) -> u64 {
    let z = counter.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Random {
    pub(super) const fn new(seed: u64) -> Self {
        let state = [
            hash(seed),
            hash(seed ^ 0x5851_F42D_4C95_7F2D),
            hash(seed ^ 0x1405_7B7E_F767_814F),
            hash(seed ^ 0x2545_F491_4F6C_DD1D),
        ];
        Self { state, spare: None }
    }

    pub(super) const fn next(&mut self) -> u64 {
        let [s0, s1, s2, s3] = self.state;
        let result = s0.wrapping_add(s3).rotate_left(23).wrapping_add(s0);
        let s2 = s2 ^ s0;
        let s3 = s3 ^ s1;
        self.state = [s0 ^ s3, s1 ^ s2, s2 ^ (s1 << 17), s3.rotate_left(45)];
        result
    }

    /// Returns a uniform number in (0, 1], in steps of 2⁻⁵³.
    fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        ((self.next() >> 11) + 1) as f64 * STEP
    }

    /// Returns a normal number with mean 0 and standard deviation 1, by Box and Muller: two at a time.
    pub(super) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(self.uniform()));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * self.uniform());
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Returns true with a probability of `per_million` in a million.
    pub(super) const fn chance(&mut self, per_million: u32) -> bool {
        self.next() % 1_000_000 < per_million as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_0_deviation_1_and_the_right_tails() {
        let mut random = Random::new(7);
        let (mut sum, mut squares, mut beyond_two) = (0.0, 0.0, 0);
        let count = 1_000_000;
        for _ in 0..count {
            let x = random.normal();
            sum += x;
            squares += x * x;
            beyond_two += u32::from(x.abs() > 2.0);
        }
        let n = f64::from(count);
        assert!((sum / n).abs() < 0.004);
        assert!((squares / n - 1.0).abs() < 0.006);
        assert!((f64::from(beyond_two) / n - 0.0455).abs() < 0.001);
    }

    #[test]
    fn a_seed_gives_the_same_numbers_on_every_machine() {
        let mut random = Random::new(1);
        let first: [u64; 3] = core::array::from_fn(|_| random.next());
        assert_eq!(first, FIRST);
        let normal: [u64; 2] = core::array::from_fn(|_| random.normal().to_bits());
        assert_eq!(normal, NORMAL);
    }

    /// Computed by an implementation in another language.
    const FIRST: [u64; 3] =
        [997_370_147_696_787_464, 11_176_634_544_585_163_408, 6_120_191_020_447_284_676];
    const NORMAL: [u64; 2] = [0xbffd_2a8f_4336_1f1d, 0xbffe_37f3_9405_e039];
}
