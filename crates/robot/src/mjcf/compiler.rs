//! What <compiler> declares of masses and inertias.

use roxmltree::Node;

use crate::attributes::{fixed, line};
use crate::tree::FileFault;

/// Which shapes would give a body without <inertial> its mass.
pub(super) struct ShapeInertia {
    /// Whether any would.
    pub(super) counted: bool,
    /// Range of groups of geoms that would.
    pub(super) groups: [f64; 2],
}

/// Attributes that change masses and inertias.
const CHANGES: [&str; 4] = ["boundmass", "boundinertia", "settotalmass", "balanceinertia"];
/// How a file is read whose masses are made by rules that are not read.
pub(super) const COMPILED: &str = "save the model as MuJoCo compiled it (mj_saveLastXML), and give that file";

impl ShapeInertia {
    /// Of a model's compiler sections, the last of which counts.
    pub(super) fn read<'a, 'i: 'a>(compilers: impl Iterator<Item = Node<'a, 'i>>) -> Result<Self, FileFault> {
        let mut all = Self { counted: true, groups: [0.0, 5.0] };
        for compiler in compilers {
            let changed = |name: &&str| match compiler.attribute(*name) {
                Some(text) => text == "true" || text.parse().is_ok_and(|bound: f64| bound > 0.0),
                None => false,
            };
            if let Some(name) = CHANGES.iter().find(|name| changed(name)) {
                let why =
                    format!("<compiler {name}> changes masses or inertias, which is not read; {COMPILED}");
                return Err((line(compiler), why));
            }
            if compiler.attribute("coordinate") == Some("global") {
                let why = "<compiler coordinate=\"global\"> has no meaning in MuJoCo since 2.3.4; save the model with MuJoCo 2.3.3, and give that file";
                return Err((line(compiler), why.into()));
            }
            match compiler.attribute("inertiafromgeom") {
                Some("true") => {
                    let why = format!(
                        "<compiler inertiafromgeom=\"true\"> takes inertias from shapes, which are not read; {COMPILED}"
                    );
                    return Err((line(compiler), why));
                }
                Some("false") => all.counted = false,
                Some("auto") => all.counted = true,
                None => {}
                Some(other) => {
                    return Err((
                        line(compiler),
                        format!("inertiafromgeom=\"{other}\": write true, false or auto"),
                    ));
                }
            }
            if let Some(text) = compiler.attribute("inertiagrouprange") {
                all.groups = fixed(compiler, "inertiagrouprange", text)?;
            }
        }
        Ok(all)
    }
}
