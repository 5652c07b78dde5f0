//! Forward-mode dual numbers with `N` derivatives.

use crate::Scalar;
use core::cmp::Ordering;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// value + sum of `eps[i]` times an infinitesimal: `eps[i]` is the derivative in direction `i`.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// The derivatives, one per direction.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number with given value and derivatives.
    pub fn new(re: f64, eps: [f64; N]) -> Self {
        Self { re, eps }
    }
    /// The variable of direction `i`: derivative 1 there, 0 elsewhere.
    pub fn variable(re: f64, i: usize) -> Self {
        let mut eps = [0.0; N];
        if let Some(e) = eps.get_mut(i) {
            *e = 1.0;
        }
        Self { re, eps }
    }
    /// f(self) for a function with value `f` and derivative `df` at `self.re`.
    ///
    /// A direction along which self does not move stays at 0 even where `df` is infinite.
    #[inline]
    fn chain(self, f: f64, df: f64) -> Self {
        Self { re: f, eps: self.eps.map(|e| if e == 0.0 { 0.0 } else { e * df }) }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self { re: 0.0, eps: [0.0; N] }
    }
}
impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re
    }
}
impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

#[inline]
fn zip<const N: usize>(a: [f64; N], b: [f64; N], f: impl Fn(f64, f64) -> f64) -> [f64; N] {
    core::array::from_fn(|i| f(a[i], b[i]))
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.eps.map(|e| -e) }
    }
}
impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, eps: zip(self.eps, o.eps, |a, b| a + b) }
    }
}
impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self { re: self.re - o.re, eps: zip(self.eps, o.eps, |a, b| a - b) }
    }
}
#[allow(clippy::suspicious_arithmetic_impl)] // the product rule
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re, eps: zip(self.eps, o.eps, |a, b| a * o.re + self.re * b) }
    }
}
#[allow(clippy::suspicious_arithmetic_impl)] // the quotient rule
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let q = self.re / o.re;
        Self { re: q, eps: zip(self.eps, o.eps, |a, b| (a - q * b) / o.re) }
    }
}
impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        Self { re: self.re + o, eps: self.eps }
    }
}
impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        Self { re: self.re - o, eps: self.eps }
    }
}
impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self { re: self.re * o, eps: self.eps.map(|e| e * o) }
    }
}
impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        Self { re: self.re / o, eps: self.eps.map(|e| e / o) }
    }
}
impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl<const N: usize> MulAssign for Dual<N> {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}
impl<const N: usize> DivAssign for Dual<N> {
    fn div_assign(&mut self, o: Self) {
        *self = *self / o;
    }
}

impl<const N: usize> Scalar for Dual<N> {
    fn constant(value: f64) -> Self {
        Self { re: value, eps: [0.0; N] }
    }
    fn value(self) -> f64 {
        self.re
    }
    fn vanishes(self) -> bool {
        self.re == 0.0 && self.eps.iter().all(|e| *e == 0.0)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.re.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    fn exp(self) -> Self {
        let e = self.re.exp();
        self.chain(e, e)
    }
    fn ln(self) -> Self {
        self.chain(self.re.ln(), 1.0 / self.re)
    }
    fn sqrt(self) -> Self {
        let s = self.re.sqrt();
        self.chain(s, if s == 0.0 { 0.0 } else { 0.5 / s })
    }
    fn tanh(self) -> Self {
        let t = self.re.tanh();
        self.chain(t, 1.0 - t * t)
    }
    fn powi(self, exponent: i32) -> Self {
        let d = if exponent == 0 { 0.0 } else { f64::from(exponent) * self.re.powi(exponent - 1) };
        self.chain(self.re.powi(exponent), d)
    }
    fn powf(self, exponent: Self) -> Self {
        let (x, n) = (self.re, exponent.re);
        let f = x.powf(n);
        if x == 0.0 {
            // The limit from the right; below the exponent 1 the slope is infinite and taken as 0.
            let dx = if n == 1.0 { 1.0 } else { 0.0 };
            return self.chain(f, dx);
        }
        let (dx, dn) = (n * x.powf(n - 1.0), f * x.ln());
        let along = |e: f64, d: f64| if e == 0.0 { 0.0 } else { e * d };
        Self { re: f, eps: zip(self.eps, exponent.eps, |a, b| along(a, dx) + along(b, dn)) }
    }
    fn atan2(self, other: Self) -> Self {
        let r2 = self.re * self.re + other.re * other.re;
        let (a, b) = if r2 == 0.0 { (0.0, 0.0) } else { (other.re / r2, -self.re / r2) };
        Self { re: self.re.atan2(other.re), eps: zip(self.eps, other.eps, |y, x| a * y + b * x) }
    }
}
