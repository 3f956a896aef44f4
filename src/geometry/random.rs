//! Numbers for tests that ask many random questions: the same ones in every run.

use glam::DVec3;

/// Numbers between −1 and 1 from a counter (Steele, Lea & Flood's mixer), so that every run asks the same.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    pub fn share(&mut self) -> f64 {
        0.5 * (self.number() + 1.0)
    }
}
