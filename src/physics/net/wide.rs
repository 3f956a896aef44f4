//! Arithmetic of [`Lanes`] as it is written: four numbers with the machine that works on them.

use std::ops::{Add, Div, Mul, Sub};

use super::lanes::Lanes;

/// x, y, z of four vectors.
pub type Vectors<L> = [Wide<L>; 3];

#[inline(always)]
pub fn vectors<L: Lanes>(lanes: L, [x, y, z]: [L::V; 3]) -> Vectors<L> {
    [Wide(lanes, x), Wide(lanes, y), Wide(lanes, z)]
}

#[inline(always)]
pub fn dot<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> Wide<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Four numbers with the machine that works on them, for arithmetic as it is written.
#[derive(Clone, Copy)]
pub struct Wide<L: Lanes>(pub L, pub L::V);

impl<L: Lanes> Wide<L> {
    #[inline(always)]
    pub fn splat(lanes: L, x: f64) -> Wide<L> {
        Wide(lanes, lanes.splat(x))
    }

    #[inline(always)]
    pub fn load(lanes: L, from: &[f64; 4]) -> Wide<L> {
        Wide(lanes, lanes.load(from))
    }

    #[inline(always)]
    pub fn store(self) -> [f64; 4] {
        self.0.store(self.1)
    }

    /// The larger in each lane; `self` where one of them is not a number.
    #[inline(always)]
    pub fn larger(self, other: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.larger(self.1, other.1))
    }

    /// `self` where `test` is above zero, zero elsewhere.
    #[inline(always)]
    pub fn where_positive(self, test: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.where_positive(test.1, self.1))
    }

    /// (a + b) + (c + d).
    #[inline(always)]
    pub fn sum(self) -> f64 {
        let [a, b, c, d] = self.store();
        (a + b) + (c + d)
    }

    #[inline(always)]
    pub fn largest(self) -> f64 {
        let [a, b, c, d] = self.store();
        a.max(b).max(c).max(d)
    }
}

impl<L: Lanes> Add for Wide<L> {
    type Output = Wide<L>;

    #[inline(always)]
    fn add(self, other: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.add(self.1, other.1))
    }
}

impl<L: Lanes> Sub for Wide<L> {
    type Output = Wide<L>;

    #[inline(always)]
    fn sub(self, other: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.sub(self.1, other.1))
    }
}

impl<L: Lanes> Mul for Wide<L> {
    type Output = Wide<L>;

    #[inline(always)]
    fn mul(self, other: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.mul(self.1, other.1))
    }
}

impl<L: Lanes> Mul<f64> for Wide<L> {
    type Output = Wide<L>;

    #[inline(always)]
    fn mul(self, factor: f64) -> Wide<L> {
        Wide(self.0, self.0.mul(self.1, self.0.splat(factor)))
    }
}

impl<L: Lanes> Div for Wide<L> {
    type Output = Wide<L>;

    #[inline(always)]
    fn div(self, other: Wide<L>) -> Wide<L> {
        Wide(self.0, self.0.div(self.1, other.1))
    }
}
