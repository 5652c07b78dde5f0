//! Pictures, icons, equations and licences that go into the FMUs.

/// Files of one model.
pub(crate) struct Assets {
    pub(crate) equations: &'static str,
    pub(crate) picture: &'static str,
    pub(crate) icon_svg: &'static str,
    pub(crate) icon_png: &'static [u8],
}

macro_rules! assets {
    ($folder:literal) => {
        Assets {
            equations: include_str!(concat!("../../../", $folder, "/equations.html")),
            picture: include_str!(concat!("../../../", $folder, "/mechanism.svg")),
            icon_svg: include_str!(concat!("../../../", $folder, "/icon.svg")),
            icon_png: include_bytes!(concat!("../../../", $folder, "/icon.png")),
        }
    };
}

/// The files of this model.
pub(crate) fn of(model: &str) -> Option<Assets> {
    Some(match model {
        "TwoMassJoint" => assets!("fmu-plant/assets/TwoMassJoint"),
        "PlanarManipulator" => assets!("fmu-plant/assets/PlanarManipulator"),
        "JointController" => assets!("fmu-controller/assets/JointController"),
        "ManipulatorController" => assets!("fmu-controller/assets/ManipulatorController"),
        _ => return None,
    })
}

/// Names and texts.
pub(crate) const LICENCES: &[(&str, &str)] = &[
    ("LICENSE-MIT.txt", include_str!("../../../LICENSE-MIT")),
    ("LICENSE-APACHE.txt", include_str!("../../../LICENSE-APACHE")),
];
