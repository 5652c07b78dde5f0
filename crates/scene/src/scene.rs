//! A scene: shapes fixed to parts, and where the parts are at each time.

use trueup_models::space::attitude::{quaternion, rotation};
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::vector::{Vector3, add, times};

/// Bodies that move; lengths in m, times in s, inertial axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// All is in the plane z = 0 and seen along z; else in space, with z up.
    pub planar: bool,
    /// Of the poses, increasing.
    pub time: Vec<f64>,
    /// Its lengths are none of the plant's.
    pub symbolic: bool,
    /// What of a planar scene is looked at; all of it when left out.
    pub window: Option<SceneWindow>,
    /// Motions laid over each other, by name: the first is drawn solid. Empty: there is one, which needs no name.
    pub layers: Vec<String>,
    /// What is drawn, carriers first.
    pub parts: Vec<ScenePart>,
    /// What a viewer needs to read it: exaggerations, what is left out.
    pub notes: Vec<String>,
}

/// A square of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneWindow {
    /// Its centre, m.
    pub center: [f64; 2],
    /// Half of its side, m.
    pub half: f64,
}

/// What a part is, which determines its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartLook {
    /// It does not move.
    Ground,
    /// A satellite, a chaser, a base.
    Base,
    /// A link of an arm.
    Link,
    /// A motor's side of a joint.
    Motor,
    /// A flexible appendage.
    Panel,
    /// What is to be captured.
    Target,
    /// Part of what a diagnosis names.
    Lit,
}

/// A rigid part with its poses.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePart {
    /// Its name.
    pub name: String,
    /// Which of the layers it belongs to.
    pub layer: usize,
    /// Its sort.
    pub look: PartLook,
    /// Shapes in its own axes.
    pub shapes: Vec<SceneShape>,
    /// One pose per time, or a single one of a part that does not move.
    pub poses: Vec<ScenePose>,
}

/// Where a part is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenePose {
    /// Origin of its axes, m.
    pub origin: [f64; 3],
    /// Its axes to the inertial ones, quaternion w, x, y, z.
    pub turn: [f64; 4],
}

/// A shape; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneShape {
    /// A rod with round ends.
    Rod {
        /// One end.
        from: Vector3<f64>,
        /// The other end.
        to: Vector3<f64>,
        /// Of its section.
        radius: f64,
    },
    /// A cuboid along the part's axes.
    Block {
        /// Its centre.
        center: Vector3<f64>,
        /// Half of its lengths.
        half: Vector3<f64>,
    },
    /// A ball.
    Ball {
        /// Its centre.
        center: Vector3<f64>,
        /// m.
        radius: f64,
    },
    /// The axis of a joint goes through here.
    Joint(Vector3<f64>),
    /// A tip, whose way is drawn.
    Tip(Vector3<f64>),
    /// A line that bends: its points at each time.
    Curve {
        /// As many points at each time.
        points: Vec<Vec<Vector3<f64>>>,
        /// Of its section.
        radius: f64,
    },
    /// A surface that bends: points of its two edges by turns, at each time.
    Strip(Vec<Vec<Vector3<f64>>>),
}

impl ScenePose {
    /// In the origin, not turned.
    pub const NEUTRAL: Self = Self { origin: [0.0; 3], turn: [1.0, 0.0, 0.0, 0.0] };

    /// In the plane, turned by an angle in rad about z.
    pub fn planar(origin: [f64; 2], angle: f64) -> Self {
        let (sin, cos) = (0.5 * angle).sin_cos();
        Self { origin: [origin[0], origin[1], 0.0], turn: [cos, 0.0, 0.0, sin] }
    }
    /// A point of the part (own axes, m) in inertial axes, m.
    pub fn placed(&self, point: Vector3<f64>) -> Vector3<f64> {
        add(self.origin, times(&rotation(self.turn), point))
    }
    /// Of a planar pose, rad.
    pub fn angle(&self) -> f64 {
        2.0 * self.turn[3].atan2(self.turn[0])
    }
    /// Of a frame.
    pub fn of(frame: &SpatialFrame<f64>) -> Self {
        Self { origin: frame.origin, turn: quaternion(&frame.rotation) }
    }
}

impl Scene {
    /// Puts the parts of another scene of the same times into this one: they share the inertial axes.
    pub fn join(&mut self, other: Self) {
        if self.parts.is_empty() {
            *self = other;
            return;
        }
        self.planar &= other.planar;
        self.parts.extend(other.parts);
        self.notes.extend(other.notes.into_iter().filter(|n| !self.notes.contains(n)).collect::<Vec<_>>());
    }

    /// Lays another motion of the same plant over this one.
    pub fn lay_over(&mut self, name: &str, other: Self) {
        let layer = self.layers.len();
        self.layers.push(name.to_owned());
        self.planar = other.planar;
        self.time = other.time;
        self.parts.extend(other.parts.into_iter().map(|part| ScenePart { layer, ..part }));
        self.notes.extend(other.notes.into_iter().filter(|n| !self.notes.contains(n)).collect::<Vec<_>>());
    }

    /// A planar scene as it is seen from a part of it, about which it shows so far, m; `None`: there is no such part.
    pub fn close_up(&self, part: &str, half: f64) -> Option<Self> {
        let eye = self.parts.iter().find(|p| p.name == part)?.poses.clone();
        let seen = |k: usize, pose: &ScenePose| {
            let from = eye.get(k).or_else(|| eye.first()).copied().unwrap_or(ScenePose::NEUTRAL);
            let (sin, cos) = from.angle().sin_cos();
            let [x, y] = [0, 1].map(|i| pose.origin[i] - from.origin[i]);
            ScenePose::planar([cos * x + sin * y, cos * y - sin * x], pose.angle() - from.angle())
        };
        let mut scene = self.clone();
        for part in &mut scene.parts {
            let still = part.poses.len() < 2;
            let rows = if still { eye.len() } else { part.poses.len() };
            let at = |k: usize| part.poses[if still { 0 } else { k }];
            part.poses = (0..rows).map(|k| seen(k, &at(k))).collect();
        }
        scene.window = Some(SceneWindow { center: [0.0; 2], half });
        Some(scene)
    }
}
