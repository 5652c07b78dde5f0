//! Places and orientations, in the file's units and conventions.

use roxmltree::Node;
use trueup_models::space::attitude::{about, rotation};
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::vector::{Matrix3, Vector3, cross, dot, identity, product, scale, sub};

use crate::attributes::{fixed, line};
use crate::tree::FileFault;

/// What <compiler> declares of angles.
pub(super) struct AngleUnits {
    /// rad per unit.
    unit: f64,
    /// Axes of Euler angles: lower case about axes that turn with the body, upper case about those of the parent.
    sequence: String,
}

impl AngleUnits {
    /// Of a model's compiler sections, the last of which counts.
    pub(super) fn read<'a, 'i: 'a>(compilers: impl Iterator<Item = Node<'a, 'i>>) -> Result<Self, FileFault> {
        let mut all = Self { unit: 1f64.to_radians(), sequence: "xyz".into() };
        for node in compilers {
            match node.attribute("angle") {
                None => {}
                Some("radian") => all.unit = 1.0,
                Some("degree") => all.unit = 1f64.to_radians(),
                Some(other) => {
                    return Err((line(node), format!("angle=\"{other}\": write radian or degree")));
                }
            }
            if let Some(text) = node.attribute("eulerseq") {
                if text.len() != 3 || !text.chars().all(|c| "xyzXYZ".contains(c)) {
                    return Err((
                        line(node),
                        format!("eulerseq=\"{text}\": write three of x, y, z, X, Y, Z"),
                    ));
                }
                all.sequence = text.to_owned();
            }
        }
        Ok(all)
    }

    /// `pos` and the orientation of an element, whichever way that is given.
    pub(super) fn frame(&self, node: Node<'_, '_>) -> Result<SpatialFrame<f64>, FileFault> {
        let origin = node.attribute("pos").map_or(Ok([0.0; 3]), |text| fixed(node, "pos", text))?;
        Ok(SpatialFrame { rotation: self.rotation(node)?, origin })
    }

    fn rotation(&self, node: Node<'_, '_>) -> Result<Matrix3<f64>, FileFault> {
        let given = orientations(node);
        let (name, text) = match given[..] {
            [] => return Ok(identity()),
            [one] => one,
            [(a, _), (b, _), ..] => {
                return Err((
                    line(node),
                    format!("{a} and {b} both give the orientation; take one of them out"),
                ));
            }
        };
        let unit = |v: Vector3<f64>| {
            let length = dot(v, v).sqrt();
            (length > 1e-12)
                .then(|| scale(1.0 / length, v))
                .ok_or_else(|| (line(node), format!("{name}=\"{text}\": an axis has a length above 0")))
        };
        Ok(match name {
            "quat" => {
                let q: [f64; 4] = fixed(node, name, text)?;
                if q.iter().map(|c| c * c).sum::<f64>() < 1e-20 {
                    return Err((line(node), format!("quat=\"{text}\": a quaternion has a length above 0")));
                }
                rotation(q)
            }
            "axisangle" => {
                let [x, y, z, angle] = fixed(node, name, text)?;
                about(unit([x, y, z])?, angle * self.unit)
            }
            "xyaxes" => {
                let [a, b, c, d, e, f] = fixed(node, name, text)?;
                let x = unit([a, b, c])?;
                let along = [d, e, f];
                let y = unit(sub(along, scale(dot(x, along), x)))?;
                columns(x, y, cross(x, y))
            }
            "zaxis" => {
                let z = unit(fixed(node, name, text)?)?;
                let axis = cross([0.0, 0.0, 1.0], z);
                let sin = dot(axis, axis).sqrt();
                if sin > 1e-12 {
                    about(scale(1.0 / sin, axis), sin.atan2(z[2]))
                } else if z[2] > 0.0 {
                    identity()
                } else {
                    about([1.0, 0.0, 0.0], std::f64::consts::PI)
                }
            }
            _ => self.euler(fixed(node, name, text)?),
        })
    }

    fn euler(&self, angles: [f64; 3]) -> Matrix3<f64> {
        let mut whole = identity();
        for (axis, angle) in self.sequence.chars().zip(angles) {
            let mut unit = [0.0; 3];
            unit[match axis.to_ascii_lowercase() {
                'x' => 0,
                'y' => 1,
                _ => 2,
            }] = 1.0;
            let turn = about(unit, angle * self.unit);
            whole = if axis.is_lowercase() { product(&whole, &turn) } else { product(&turn, &whole) };
        }
        whole
    }
}

/// The orientations that an element itself gives, by name.
pub(super) fn orientations<'a>(node: Node<'a, '_>) -> Vec<(&'static str, &'a str)> {
    let named = |name: &'static str| node.attribute(name).map(|text| (name, text));
    ["quat", "axisangle", "euler", "xyaxes", "zaxis"].into_iter().filter_map(named).collect()
}

fn columns(x: Vector3<f64>, y: Vector3<f64>, z: Vector3<f64>) -> Matrix3<f64> {
    std::array::from_fn(|i| [x[i], y[i], z[i]])
}
