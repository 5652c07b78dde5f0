//! How a scene is seen: a parallel projection that all of its motion fits into.

use trueup_scene::{Scene, ScenePart, ScenePose, SceneShape};

/// Camera of a picture, from above at an angle: rad about z, rad above the plane z = 0.
const AZIMUTH: f64 = -0.9;
const ELEVATION: f64 = 0.4;
/// What is planar is seen along z.
const ELEVATION_OF_PLANE: f64 = std::f64::consts::FRAC_PI_2;
/// Room around what is drawn.
const MARGIN: f64 = 1.12;

/// A parallel projection.
pub(crate) struct SceneView {
    pub(crate) planar: bool,
    /// What is in the middle of the picture, m.
    pub(crate) center: [f64; 3],
    /// Half of what is seen across and upwards, m.
    pub(crate) half: [f64; 2],
    pub(crate) azimuth: f64,
    pub(crate) elevation: f64,
    /// Of the grid on the floor, and length of the rule, m; 0: there is none.
    pub(crate) grid: f64,
    /// Height of the floor, m.
    pub(crate) floor: f64,
}

impl SceneView {
    /// Of a scene; `None` if nothing of it is anywhere.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        if let Some(window) = scene.window {
            return Some(Self {
                planar: true,
                center: [window.center[0], window.center[1], 0.0],
                half: [window.half; 2],
                azimuth: AZIMUTH,
                elevation: ELEVATION_OF_PLANE,
                grid: round_length(0.4 * window.half),
                floor: 0.0,
            });
        }
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut all = Vec::new();
        for part in &scene.parts {
            extent(part, |point, radius| {
                all.push((point, radius));
                for i in 0..3 {
                    least[i] = least[i].min(point[i] - radius);
                    most[i] = most[i].max(point[i] + radius);
                }
            });
        }
        let found = least.iter().chain(&most).all(|v| v.is_finite());
        let center: [f64; 3] = std::array::from_fn(|i| 0.5 * (least[i] + most[i]));
        let mut half = [0.5 * (most[0] - least[0]), 0.5 * (most[1] - least[1])];
        let elevation = if scene.planar { ELEVATION_OF_PLANE } else { ELEVATION };
        if !scene.planar {
            // Whichever way it is turned about z.
            let (sin, cos) = elevation.sin_cos();
            half = [0.0; 2];
            for (point, radius) in &all {
                let d: [f64; 3] = std::array::from_fn(|i| point[i] - center[i]);
                let around = d[0].hypot(d[1]);
                half[0] = half[0].max(around + radius);
                half[1] = half[1].max(cos * d[2].abs() + sin * around + radius);
            }
        }
        let size = half[0].max(half[1]);
        (found && size > 0.0).then(|| Self {
            planar: scene.planar,
            center,
            half: half.map(|h| MARGIN * h.max(0.2 * size)),
            azimuth: AZIMUTH,
            elevation,
            grid: if scene.symbolic { 0.0 } else { round_length(0.4 * size) },
            floor: least[2],
        })
    }

    /// In a picture of this width and height, and how near.
    pub(crate) fn to(&self, (width, height): (f64, f64), point: [f64; 3]) -> [f64; 3] {
        let scale = self.scale((width, height));
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| point[i] - self.center[i]);
        if self.planar {
            return [0.5 * width + scale * x, 0.5 * height - scale * y, z];
        }
        let ((sa, ca), (se, ce)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        let out = ca * x + sa * y;
        [
            0.5 * width + scale * (ca * y - sa * x),
            0.5 * height - scale * (ce * z - se * out),
            ce * out + se * z,
        ]
    }

    /// Pixels per m.
    pub(crate) fn scale(&self, (width, height): (f64, f64)) -> f64 {
        (0.5 * width / self.half[0]).min(0.5 * height / self.half[1])
    }
}

/// The largest of 1, 2, 5 times a power of ten that is not above it.
fn round_length(value: f64) -> f64 {
    let exponent = value.log10().floor() as i32;
    let text = |m: u32| format!("{m}e{exponent}").parse().unwrap_or(value);
    [5, 2, 1].into_iter().map(text).find(|v| *v <= value).unwrap_or(value)
}

/// Shows all points of a part, with what is around them.
fn extent(part: &ScenePart, mut see: impl FnMut([f64; 3], f64)) {
    for shape in &part.shapes {
        let mut of_all = |points: &[[f64; 3]], radius: f64| {
            for pose in &part.poses {
                points.iter().for_each(|p| see(pose.placed(*p), radius));
            }
        };
        match shape {
            SceneShape::Rod { from, to, radius } => of_all(&[*from, *to], *radius),
            SceneShape::Block { center, half } => of_all(&corners(*center, *half), 0.0),
            SceneShape::Ball { center, radius } => of_all(&[*center], *radius),
            SceneShape::Joint(at) | SceneShape::Tip(at) => of_all(&[*at], 0.0),
            SceneShape::Curve { points, .. } | SceneShape::Strip(points) => {
                for (k, points) in points.iter().enumerate() {
                    if let Some(pose) = pose_at(part, k) {
                        points.iter().for_each(|p| see(pose.placed(*p), 0.0));
                    }
                }
            }
        }
    }
}

/// The eight corners of a cuboid; bits of the index: x, y, z above the centre.
pub(crate) fn corners(center: [f64; 3], half: [f64; 3]) -> [[f64; 3]; 8] {
    std::array::from_fn(|k| {
        std::array::from_fn(|i| center[i] + if k >> (2 - i) & 1 == 1 { half[i] } else { -half[i] })
    })
}

/// Of the times of a scene.
pub(crate) fn pose_at(part: &ScenePart, k: usize) -> Option<&ScenePose> {
    part.poses.get(k).or_else(|| part.poses.first())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_have_round_lengths() {
        for (value, wanted) in [(0.4, 0.2), (1.0, 1.0), (73.0, 50.0), (0.0031, 0.002)] {
            assert_eq!(round_length(value), wanted);
        }
    }
}
