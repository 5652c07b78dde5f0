//! Maxwell-slip: springs in series with sliders, all driven by one displacement.

/// A bank of elements (Iwan 1966). Exact for a displacement that is monotone between two commits.
#[derive(Clone, Debug)]
pub(crate) struct Slip {
    /// Displacement at which each element begins to slide, and the torque that it holds then.
    elements: Vec<(f64, f64)>,
    deformed: Vec<f64>,
    from: f64,
}

impl Slip {
    /// `yields`: (displacement, torque) per element.
    pub(crate) fn new(yields: Vec<(f64, f64)>) -> Self {
        let deformed = vec![0.0; yields.len()];
        Self { elements: yields, deformed, from: 0.0 }
    }
    /// Torque against the displacement `x`.
    pub(crate) fn torque(&self, x: f64) -> f64 {
        let one = |((limit, torque), z): (&(f64, f64), &f64)| {
            torque * (z + x - self.from).clamp(-limit, *limit) / limit
        };
        self.elements.iter().zip(&self.deformed).map(one).sum()
    }
    /// The displacement is `x` now.
    pub(crate) fn commit(&mut self, x: f64) {
        for ((limit, _), z) in self.elements.iter().zip(&mut self.deformed) {
            *z = (*z + x - self.from).clamp(-limit, *limit);
        }
        self.from = x;
    }
    /// Relaxed at `x`.
    pub(crate) fn rest(&mut self, x: f64) {
        self.deformed.fill(0.0);
        self.from = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closes_its_loops_and_remembers_the_turning_point() {
        let mut s = Slip::new(vec![(0.1, 2.0), (0.3, 1.0)]);
        s.commit(1.0);
        assert!((s.torque(1.0) - 3.0).abs() < 1e-15, "all slide");
        s.commit(0.9);
        let inside = s.torque(0.9);
        s.commit(1.0);
        assert!((s.torque(1.0) - 3.0).abs() < 1e-15, "back at the turning point");
        // Unloading by 0.1: the first gives back 2, the second 1/3.
        assert!((inside - (3.0 - 2.0 - 1.0 / 3.0)).abs() < 1e-12);
    }
}
