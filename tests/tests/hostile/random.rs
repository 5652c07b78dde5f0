//! Repeatable random choices.

use super::fmu::{Kind, Variable};

/// splitmix64.
pub struct Random {
    state: u64,
    /// Values of any size go into the model; they cost time, because they make it stiff.
    extreme: bool,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self { state: seed.wrapping_mul(0x2545_f491_4f6c_dd1d), extreme: false };
        random.extreme = random.once_in(10);
        random
    }
    pub fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
    /// True once in `n` times.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn odd(&mut self) -> f64 {
        self.pick(&[
            f64::NAN,
            -f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            1e300,
            -1e18,
            1e9,
            f64::MIN_POSITIVE,
            5e-324,
            -1e-310,
            -0.0,
            0.0,
            -1.0,
        ])
    }
    /// A number of any size, mostly of the order of 1.
    pub fn number(&mut self) -> f64 {
        if self.once_in(5) { self.odd() } else { 4.0 * self.unit() - 2.0 }
    }
    /// A value for an element of a variable, mostly one that it may have.
    pub fn value(&mut self, v: &Variable, element: usize) -> f64 {
        let start = v.start.get(element).copied().unwrap_or(0.0);
        match v.kind {
            Kind::Real if self.once_in(25) && self.extreme => self.odd(),
            Kind::Real if self.once_in(25) => {
                self.pick(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, -0.0, 0.0])
            }
            Kind::Real if start == 0.0 => self.unit() - 0.5,
            Kind::Real => start * (0.2 + 2.0 * self.unit()),
            _ => f64::from(self.pick(&[0, 1, 1, 1, 2, 2, 3, 4, 5, -1, i32::MAX, i32::MIN])),
        }
    }
}
