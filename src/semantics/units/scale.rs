//! The size of a unit as a fraction of two numbers, so that decimal prefixes stay exact.

use crate::semantics::value::Dimension;

/// `numerator / denominator` SI units of a dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub numerator: f64,
    pub denominator: f64,
    pub dimension: Dimension,
}

impl Scale {
    pub const ONE: Scale = Scale { numerator: 1.0, denominator: 1.0, dimension: Dimension::NONE };

    pub fn ten_to(exponent: i32) -> Scale {
        let power = 10f64.powi(exponent.abs());
        if exponent < 0 { Scale { denominator: power, ..Self::ONE } } else { Scale { numerator: power, ..Self::ONE } }
    }

    /// A plain number; a decimal fraction such as 25.4 becomes 254 / 10.
    pub fn number(value: f64) -> Scale {
        let mut power = 1.0;
        while power < 1e15 && (value * power).fract() != 0.0 {
            power *= 10.0;
        }
        let scaled = value * power;
        if scaled.fract() == 0.0 && scaled.abs() < 9e15 {
            Scale { numerator: scaled, denominator: power, ..Self::ONE }.reduced()
        } else {
            Scale { numerator: value, ..Self::ONE }
        }
    }

    pub fn times(self, other: Scale) -> Option<Scale> {
        let product = Scale {
            numerator: self.numerator * other.numerator,
            denominator: self.denominator * other.denominator,
            dimension: self.dimension.times(other.dimension)?,
        };
        product.sane()
    }

    pub fn per(self, other: Scale) -> Option<Scale> {
        self.times(other.power(-1)?)
    }

    pub fn power(self, power: i32) -> Option<Scale> {
        let (over, under) =
            if power < 0 { (self.denominator, self.numerator) } else { (self.numerator, self.denominator) };
        let size = i32::try_from(power.unsigned_abs()).ok()?;
        let dimension = self.dimension.power(power, 1)?;
        Scale { numerator: over.powi(size), denominator: under.powi(size), dimension }.sane()
    }

    fn sane(self) -> Option<Scale> {
        let fits = |x: f64| x.is_finite() && x != 0.0;
        (fits(self.numerator) && fits(self.denominator)).then(|| self.reduced())
    }

    /// Cancels a common whole divisor where one side divides the other.
    fn reduced(self) -> Scale {
        let Scale { numerator, denominator, dimension } = self;
        if numerator % denominator == 0.0 {
            Scale { numerator: numerator / denominator, denominator: 1.0, dimension }
        } else if denominator % numerator == 0.0 {
            Scale { numerator: 1.0, denominator: denominator / numerator, dimension }
        } else {
            self
        }
    }
}
