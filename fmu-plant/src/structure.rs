//! What of a model's structure is chosen when it is packed: whole numbers by name in the configuration.

use trueup_fmi::configuration::Configuration;
use trueup_models::arm::{BASE, BASE_CHOICE, JOINT_DRIVE, JOINT_DRIVE_CHOICE};
use trueup_models::contact::layout::{AGAINST, CHASER, CLOSING, MOUNT};
use trueup_models::contact::{MAX_BALLS, MAX_PORTS};
use trueup_models::flexible_arm::layout::{
    AXIAL, AXIAL_CHOICE, DRIVE, DRIVE_CHOICE, LINKS, LINKS_CHOICE, SHAPES_CHOICE, SOLVER, SOLVER_CHOICE,
};
use trueup_models::joint::{GEARBOX, GEARBOX_CHOICE};
use trueup_models::layout::Items;
use trueup_models::space::ritz::MAX_LINK_SHAPES;

/// Something that is chosen.
#[derive(Clone, Copy, Debug)]
pub struct StructureOption {
    /// Its name, that of the constant that shows it.
    pub name: &'static str,
    /// What may be chosen.
    pub wanted: RequestedStructure,
    /// Meaning.
    pub text: &'static str,
}

/// What may be chosen.
#[derive(Clone, Copy, Debug)]
pub enum RequestedStructure {
    /// A number from 1 to this.
    Count(usize),
    /// An item, counted from 1.
    Item(&'static Items),
}

pub(crate) const BALLS: &str = "numberOfBalls";
pub(crate) const PORTS: &str = "numberOfPorts";
pub(crate) const CLOSES: &str = "closing";
pub(crate) const MOUNTED: &str = "endBallMount";
pub(crate) const TOUCHES: &str = "against";
pub(crate) const CHASES: &str = "chaser";
/// Items of [`CHASES`].
pub(crate) const RIGID: u32 = 1;
pub(crate) const PLANAR: u32 = 2;
pub(crate) const SPATIAL: u32 = 3;

static OF_JOINT: [StructureOption; 1] = [StructureOption {
    name: GEARBOX_CHOICE,
    wanted: RequestedStructure::Item(&GEARBOX),
    text: "What describes the transmission",
}];
static OF_ARM: [StructureOption; 2] = [
    StructureOption {
        name: BASE_CHOICE,
        wanted: RequestedStructure::Item(&BASE),
        text: "What becomes of the base",
    },
    StructureOption {
        name: JOINT_DRIVE_CHOICE,
        wanted: RequestedStructure::Item(&JOINT_DRIVE),
        text: "What drives the joints; by acceleration: inverse dynamics",
    },
];
static OF_BODY: [StructureOption; 1] =
    [StructureOption { name: PORTS, wanted: RequestedStructure::Count(MAX_PORTS), text: "Docking points" }];
static OF_SCENE: [StructureOption; 5] = [
    StructureOption {
        name: CHASES,
        wanted: RequestedStructure::Item(&CHASER),
        text: "What carries the hand",
    },
    StructureOption {
        name: BALLS,
        wanted: RequestedStructure::Count(MAX_BALLS),
        text: "Balls of the gripper, P1 first",
    },
    StructureOption { name: CLOSES, wanted: RequestedStructure::Item(&CLOSING), text: "What moves the jaws" },
    StructureOption {
        name: MOUNTED,
        wanted: RequestedStructure::Item(&MOUNT),
        text: "How a ball is fixed to the hand",
    },
    StructureOption {
        name: TOUCHES,
        wanted: RequestedStructure::Item(&AGAINST),
        text: "What the balls may touch",
    },
];

static OF_FLEXIBLE_ARM: [StructureOption; 5] = [
    StructureOption {
        name: AXIAL_CHOICE,
        wanted: RequestedStructure::Item(&AXIAL),
        text: "Whether loads along links stiffen them",
    },
    StructureOption {
        name: DRIVE_CHOICE,
        wanted: RequestedStructure::Item(&DRIVE),
        text: "What the motors are driven by",
    },
    StructureOption {
        name: LINKS_CHOICE,
        wanted: RequestedStructure::Item(&LINKS),
        text: "Whether the links bend",
    },
    StructureOption {
        name: SHAPES_CHOICE,
        wanted: RequestedStructure::Count(MAX_LINK_SHAPES),
        text: "Shapes of each link in each direction of bending",
    },
    StructureOption {
        name: SOLVER_CHOICE,
        wanted: RequestedStructure::Item(&SOLVER),
        text: "How Co-Simulation integrates",
    },
];

/// What is chosen of this model's structure by name; of the others it is given by joints or by a robot.
pub fn choices(model: &str) -> &'static [StructureOption] {
    match model {
        "TwoMassJoint" => &OF_JOINT,
        "PlanarManipulator" => &OF_ARM,
        "FlexibleArm" => &OF_FLEXIBLE_ARM,
        "FreeBody" => &OF_BODY,
        "GripperContact" => &OF_SCENE[1..],
        "CaptureScene" => &OF_SCENE,
        _ => &[],
    }
}

impl StructureOption {
    /// What may be chosen, in words.
    pub fn range(&self) -> String {
        match self.wanted {
            RequestedStructure::Count(most) => format!("1 to {most}"),
            RequestedStructure::Item(items) => items.items.iter().map(|i| i.0).collect::<Vec<_>>().join(", "),
        }
    }
    /// The number that a text gives.
    ///
    /// # Errors
    /// It gives none: what would.
    pub fn parse(&self, text: &str) -> Result<u32, String> {
        let number = match self.wanted {
            RequestedStructure::Count(_) => text.parse().ok(),
            RequestedStructure::Item(items) => {
                items.items.iter().position(|i| i.0 == text).map(|i| i as u32 + 1)
            }
        };
        number
            .filter(|n| self.allows(*n))
            .ok_or_else(|| format!("`{}` requires one of {}, not `{text}`", self.name, self.range()))
    }
    fn allows(&self, number: u32) -> bool {
        let most = match self.wanted {
            RequestedStructure::Count(most) => most,
            RequestedStructure::Item(items) => items.items.len(),
        };
        (1..=most).contains(&(number as usize))
    }
}

/// A configuration's hand is carried by this item of [`CHASER`].
pub(crate) fn carried_by(c: &Configuration, chaser: u32) -> bool {
    c.structure.iter().any(|s| s.0 == CHASES && s.1 == [chaser])
}

/// What a configuration chooses of a structure: the number by its name, if it is there.
///
/// # Errors
/// Something that the model has not, or that cannot be chosen.
pub(crate) fn chosen(c: &Configuration) -> Result<impl Fn(&str) -> Option<usize> + '_, String> {
    let known = choices(&c.model);
    for (name, values) in &c.structure {
        let Some(choice) = known.iter().find(|k| k.name == name) else {
            let names = known.iter().map(|k| k.name).collect::<Vec<_>>().join(", ");
            return Err(format!("{} has no `{name}` to choose; it has {names}", c.model));
        };
        if !matches!(values[..], [one] if choice.allows(one)) {
            return Err(format!("`{name}` = {values:?}: it is one of {}", choice.range()));
        }
    }
    Ok(|name: &str| c.structure.iter().find(|s| s.0 == name).and_then(|s| s.1.first()).map(|v| *v as usize))
}
