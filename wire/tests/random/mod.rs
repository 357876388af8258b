//! A generator with a fixed seed (PCG, O'Neill 2014).

pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u32 {
        let state = self.0;
        self.0 =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = ((state >> 18 ^ state) >> 27) as u32;
        mixed.rotate_right((state >> 59) as u32)
    }

    pub fn below(&mut self, bound: usize) -> usize {
        self.next() as usize % bound
    }
}
