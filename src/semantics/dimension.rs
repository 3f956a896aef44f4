//! The algebra of dimensions: products, quotients, and powers that stay exact.

use super::value::Dimension;

/// Exponents are held in twelfths.
const WHOLE: i16 = 12;

impl Dimension {
    /// That of a ratio.
    pub const NONE: Dimension = Dimension([0; 8]);

    /// The `index`-th base dimension; None where there are more than fit.
    pub fn base(index: usize) -> Option<Dimension> {
        let mut exponents = [0; 8];
        *exponents.get_mut(index)? = WHOLE;
        Some(Dimension(exponents))
    }

    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Dimension of a product; None where an exponent grows beyond all sense.
    pub fn times(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i16::checked_add)
    }

    /// Dimension of a quotient.
    pub fn per(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i16::checked_sub)
    }

    /// Dimension of a power with exponent `numerator / denominator`; None where a twelfth is too coarse for it.
    pub fn power(self, numerator: i32, denominator: i32) -> Option<Dimension> {
        let mut out = [0; 8];
        for (slot, exponent) in out.iter_mut().zip(self.0) {
            let scaled = i32::from(exponent).checked_mul(numerator)?;
            if denominator == 0 || scaled % denominator != 0 {
                return None;
            }
            *slot = i16::try_from(scaled / denominator).ok()?;
        }
        Some(Dimension(out))
    }

    /// Exponents as reduced fractions, base by base: `(base, numerator, denominator)` where not zero.
    pub fn exponents(self) -> impl Iterator<Item = (usize, i16, i16)> {
        self.0.into_iter().enumerate().filter(|(_, e)| *e != 0).map(|(base, e)| {
            let common = gcd(e.unsigned_abs(), WHOLE as u16) as i16;
            (base, e / common, WHOLE / common)
        })
    }

    fn zip(self, other: Dimension, combine: impl Fn(i16, i16) -> Option<i16>) -> Option<Dimension> {
        let mut out = [0; 8];
        for (slot, (a, b)) in out.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            *slot = combine(a, b)?;
        }
        Some(Dimension(out))
    }
}

fn gcd(a: u16, b: u16) -> u16 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_dimension() -> impl Strategy<Value = Dimension> {
        proptest::array::uniform8(-60i16..60).prop_map(Dimension)
    }

    proptest! {
        #[test]
        fn products_form_an_abelian_group(a in any_dimension(), b in any_dimension(), c in any_dimension()) {
            prop_assert_eq!(a.times(b), b.times(a));
            prop_assert_eq!(a.times(b).unwrap().times(c), a.times(b.times(c).unwrap()));
            prop_assert_eq!(a.times(Dimension::NONE), Some(a));
            prop_assert_eq!(a.per(a), Some(Dimension::NONE));
            prop_assert_eq!(a.times(b).unwrap().per(b), Some(a));
        }

        #[test]
        fn roots_undo_powers(a in any_dimension(), n in 1i32..12) {
            prop_assert_eq!(a.power(n, 1).unwrap().power(1, n), Some(a));
            prop_assert_eq!(a.power(2, 1), a.times(a));
        }
    }

    #[test]
    fn a_fifth_root_of_a_length_is_refused_and_not_rounded() {
        let length = Dimension::base(0).unwrap();
        assert_eq!(length.power(1, 5), None);
        assert_eq!(length.power(1, 2).unwrap().exponents().collect::<Vec<_>>(), [(0, 1, 2)]);
        assert_eq!(length.power(1, 0), None);
        assert_eq!(length.power(30000, 1), None);
        assert_eq!(Dimension::base(8), None);
    }
}
