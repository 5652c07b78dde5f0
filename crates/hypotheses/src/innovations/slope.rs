//! What forces of laws change with the states of a plant.

/// Slope of the force on a coordinate by the position (`rate`: by the rate) of a coordinate, by node.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceSlope {
    /// Coordinate of the force.
    pub on: usize,
    /// Coordinate whose position or rate changes.
    pub by: usize,
    /// Whether it is the rate.
    pub rate: bool,
    /// N.m/rad or N.m.s/rad by node.
    pub values: Vec<f64>,
}

/// Slopes of a law: one list a recording.
pub type LawSlopes = Vec<Vec<ForceSlope>>;

/// Slopes of laws as the filter's tangents take them: forces on the coordinates by positions and rates, n x 2n a node, one entry a
/// recording; empty where no law has any.
pub fn as_matrices(laws: &[LawSlopes], coordinates: usize, nodes: &[usize]) -> Vec<Vec<f64>> {
    if laws.iter().flatten().all(Vec::is_empty) {
        return Vec::new();
    }
    let n = coordinates;
    let of_run = |(k, nodes): (usize, &usize)| {
        let mut all = vec![0.0; 2 * n * n * nodes];
        for s in laws.iter().flat_map(|l| &l[k]) {
            let at = 2 * n * s.on + n * usize::from(s.rate) + s.by;
            all.iter_mut().skip(at).step_by(2 * n * n).zip(&s.values).for_each(|(x, v)| *x += v);
        }
        all
    };
    nodes.iter().enumerate().map(of_run).collect()
}
