//! The scalar that kernels are written over.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number, possibly one that carries derivatives along ([`crate::Dual`]).
///
/// Comparisons look at the value alone: a branch taken with duals is the branch taken with `f64`.
/// Functions are defined such that neither value nor derivative becomes NaN where the derivative exists,
/// and such that the value of a dual equals the `f64` result bit by bit.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + 'static
{
    /// A number that does not depend on anything.
    fn constant(value: f64) -> Self;
    /// The value without its derivatives.
    fn value(self) -> f64;
    /// It is 0, and so is each of its derivatives: a product with it is 0 whatever the other factor depends on.
    fn vanishes(self) -> bool;

    /// Sine and cosine at once; argument in rad.
    fn sin_cos(self) -> (Self, Self);
    /// e to the power of self.
    fn exp(self) -> Self;
    /// Natural logarithm; self > 0.
    fn ln(self) -> Self;
    /// Square root; at 0 the derivative is taken as 0.
    fn sqrt(self) -> Self;
    /// Hyperbolic tangent, safe for any argument.
    fn tanh(self) -> Self;
    /// Integer power.
    fn powi(self, exponent: i32) -> Self;
    /// Real power for self >= 0; 0 to any positive power is 0 with derivative 0 (1 for the exponent 1).
    fn powf(self, exponent: Self) -> Self;
    /// Angle of the vector (x, y) = (other, self), in rad.
    fn atan2(self, other: Self) -> Self;

    /// Absolute value; at 0 the derivative is that of the positive branch.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The larger one by value (self when equal).
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() { other } else { self }
    }
    /// The smaller one by value (self when equal).
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() { other } else { self }
    }
    /// Sine; argument in rad.
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine; argument in rad.
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// Zero.
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// One.
    fn one() -> Self {
        Self::constant(1.0)
    }
    /// +1, 0 or -1 by value.
    fn signum0(self) -> f64 {
        let v = self.value();
        if v > 0.0 {
            1.0
        } else if v < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn vanishes(self) -> bool {
        self == 0.0
    }
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
    fn powi(self, exponent: i32) -> Self {
        f64::powi(self, exponent)
    }
    fn powf(self, exponent: Self) -> Self {
        f64::powf(self, exponent)
    }
    fn atan2(self, other: Self) -> Self {
        f64::atan2(self, other)
    }
}
