//! `FreeBody`, `GripperContact` and `CaptureScene`: variable tables and configurations.

use crate::arm;
use crate::arm::TEST_BED;
use crate::builder::{self, PlantTableBuilder};
use crate::experiment::{CAPTURE_TOLERANCE, TOLERANCE};
use crate::space_capture;
use crate::structure::{BALLS, CLOSES, MOUNTED, PLANAR, PORTS, RIGID, SPATIAL, TOUCHES, carried_by, chosen};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, ModelTable, TableExperiment};
use trueup_models::arm::layout::states;
use trueup_models::arm::{PlanarManipulator, input, output, parameter};
use trueup_models::contact::layout::{
    BodyInputs, BodyOutputs, BodyParameters, BodyStates, ChaserInputs, ChaserOutputs, ChaserParameters,
    ChaserStates, Command, HostParameters, Outputs, Parameters, Poses, SceneOutputs, SceneParameters,
    SceneStates, States,
};
use trueup_models::contact::spatial::SpatialCaptureScene;
use trueup_models::contact::{
    CaptureScene, Chaser, Closing, FreeBody, GripperContact, GripperStructure, Mount, PortShape, RigidChaser,
};
use trueup_models::effect::PlantKind;
use trueup_numerics::hybrid::{At, Hybrid};

/// The models of this file.
pub(crate) const MODELS: &[&str] = &["FreeBody", "GripperContact", "CaptureScene"];

/// One of them.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum Contact {
    /// `FreeBody`.
    Body(FreeBody),
    /// `GripperContact`.
    Gripper(GripperContact),
    /// `CaptureScene` with a rigid chaser.
    Scene(CaptureScene),
    /// `CaptureScene` with the planar manipulator.
    ArmScene(CaptureScene<PlanarManipulator>),
    /// `CaptureScene` with a robot in space, and start values of its parameters.
    SpaceScene(SpatialCaptureScene, Vec<f64>),
}

trueup_numerics::delegate_hybrid!(Contact {
    Contact::Body(m) => m,
    Contact::Gripper(m) => m,
    Contact::Scene(m) => m,
    Contact::ArmScene(m) => m,
    Contact::SpaceScene(m, _) => m
});

/// Bits of warnings.
const OVERLAP: u32 = 1;
const CLIPPED: u32 = 2;

/// The model of a configuration.
pub(crate) fn build(c: &Configuration) -> Result<Contact, String> {
    if carried_by(c, SPATIAL) {
        return space_capture::build(c).map(|(m, start)| Contact::SpaceScene(m, start));
    }
    let arm = carried_by(c, PLANAR);
    if let Some(effect) = c.effects.first().filter(|_| !arm) {
        let with = if c.model == "CaptureScene" {
            " with a rigid chaser: pack it with chaser=planar or spatial"
        } else {
            ""
        };
        return Err(format!("no effect acts in {}{with}, `{effect}` neither", c.model));
    }
    if !c.joint_flexible.is_empty() && !arm {
        let has =
            if c.model == "CaptureScene" { "with a rigid chaser has no joints" } else { "has no joints" };
        return Err(format!("{} {has}: leave out which are flexible", c.model));
    }
    let chosen = chosen(c)?;
    if c.model == "FreeBody" {
        return FreeBody::new(chosen(PORTS).unwrap_or(1)).map(Contact::Body);
    }
    let structure = GripperStructure {
        balls: chosen(BALLS).unwrap_or(GripperStructure::default().balls),
        closing: match chosen(CLOSES) {
            Some(2) => Closing::Command,
            Some(3) => Closing::Motor,
            _ => Closing::Schedule,
        },
        mount: match chosen(MOUNTED) {
            Some(2) => Mount::Elastic,
            Some(3) => Mount::Carriages,
            _ => Mount::Rigid,
        },
        against: match chosen(TOUCHES) {
            Some(2) => PortShape::Plate,
            Some(3) => PortShape::Bar,
            Some(4 | 5) => {
                return Err(format!(
                    "`{TOUCHES}` = cylinder and ring are in space: pack CaptureScene with chaser=spatial"
                ));
            }
            _ => PortShape::Ball,
        },
    };
    if c.model == "GripperContact" {
        GripperContact::new(structure).map(Contact::Gripper)
    } else if arm {
        let flexible = if c.joint_flexible.is_empty() { &TEST_BED[..] } else { &c.joint_flexible };
        let chaser = PlanarManipulator::new(flexible, &c.effects).map_err(|e| e.to_string())?;
        CaptureScene::new(chaser, structure).map(Contact::ArmScene)
    } else {
        CaptureScene::new(RigidChaser::default(), structure).map(Contact::Scene)
    }
}

impl Contact {
    pub(crate) fn table(&self) -> ModelTable {
        match self {
            Self::Body(m) => body(m),
            Self::Gripper(m) => gripper(m),
            Self::Scene(m) => scene(m),
            Self::ArmScene(m) => scene(m),
            Self::SpaceScene(m, start) => space_capture::table(m, start),
        }
    }
    pub(crate) fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        match self {
            Self::Body(_) => Ok(()),
            Self::Gripper(m) => m.check(p),
            Self::Scene(m) => m.check(p),
            Self::ArmScene(m) => m.check(p),
            Self::SpaceScene(m, _) => m.check(p),
        }
    }
    pub(crate) fn watch(&self, at: &At<'_, f64>, said: u32) -> Option<(u32, String)> {
        let fresh = |bit: u32| said & bit == 0;
        let overlap = || match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.overlap(at),
            Self::Scene(m) => m.overlap(at),
            Self::ArmScene(m) => m.overlap(at),
            Self::SpaceScene(m, _) => m.overlap(at),
        };
        let clipped = || match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.clipped(at),
            Self::Scene(m) => m.clipped(at),
            Self::ArmScene(m) => m.clipped(at),
            Self::SpaceScene(m, _) => m.clipped(at),
        };
        let first = fresh(OVERLAP).then(overlap).flatten().map(|text| (OVERLAP, text));
        first.or_else(|| fresh(CLIPPED).then(clipped).flatten().map(|text| (CLIPPED, text)))
    }
    pub(crate) fn long_step(&self, h: f64, p: &[f64]) -> Option<String> {
        match self {
            Self::Gripper(m) => m.long_step(h, p),
            // What the others integrate is theirs alone.
            Self::Body(_) | Self::Scene(_) | Self::ArmScene(_) | Self::SpaceScene(..) => None,
        }
    }
    pub(crate) fn singular(&self, at: &At<'_, f64>) -> Option<String> {
        match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.fault(at),
            Self::Scene(m) => m.fault(at),
            Self::ArmScene(m) => m.fault(at),
            Self::SpaceScene(m, _) => m.fault(at),
        }
    }
}

/// What is fixed when packed.
fn constants(b: &mut PlantTableBuilder, model: &str, values: &[usize]) {
    b.constant("dimension", BoundaryType::Integer, &[], &[2.0], "The model moves in the plane");
    b.structure(model, values);
}

/// In the order of a gripper's choices.
fn numbers(s: &GripperStructure) -> [usize; 4] {
    [s.balls, s.closing as usize + 1, s.mount as usize + 1, s.against as usize + 1]
}

fn body(m: &FreeBody) -> ModelTable {
    let experiment = TableExperiment { stop_time: 10.0, tolerance: CAPTURE_TOLERANCE, step_size: 1e-2 };
    let mut b = PlantTableBuilder::new(
        "FreeBody",
        "Rigid body that floats in the plane, with docking points",
        experiment,
    );
    let ports = m.ports();
    constants(&mut b, "FreeBody", &[ports]);
    b.parameters(&BodyParameters::list(&ports), &m.defaults());
    b.inputs(&BodyInputs::list(&ports));
    b.outputs(&BodyOutputs::list(&ports));
    b.moved(&BodyStates::list(&ports));
    let members = [
        ("force", "portForce"),
        ("torque", "portTorque"),
        ("position", "portPoint"),
        ("attitude", "portAttitude"),
        ("velocity", "portVelocity"),
        ("rate", "portRate"),
    ];
    b.plug("port", "What touches the body at its docking points", &members);
    b.finish(m.sizes().indicators)
}

fn gripper(m: &GripperContact) -> ModelTable {
    let experiment = TableExperiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let text = "Contact of a gripper of balls with a docking port (dynamics of on-orbit capture, eq. 20-22)";
    let mut b = PlantTableBuilder::new("GripperContact", text, experiment);
    let s = m.structure();
    constants(&mut b, "GripperContact", &numbers(s));
    b.parameters(&[Parameters::list(s), HostParameters::list(&())].concat(), &m.defaults());
    b.inputs(&Command::list(s));
    b.inputs(&Poses::list(s));
    b.outputs(&Outputs::list(s));
    b.moved(&States::list(s));
    for (side, text) in [("host", "The end effector"), ("port", "The target's docking point")] {
        let names = ["Force", "Torque", "Position", "Attitude", "Velocity", "Rate"];
        let variables = names.map(|n| format!("{side}{n}"));
        let members = names.map(str::to_lowercase);
        let pairs: Vec<_> =
            members.iter().map(String::as_str).zip(variables.iter().map(String::as_str)).collect();
        b.plug(side, text, &pairs);
    }
    b.finish(m.sizes().indicators)
}

/// What a chaser has in the table of `CaptureScene`.
trait Tabled: Chaser {
    /// Its number among the choices.
    const CHOICE: u32;
    /// Of the default experiment.
    const TOLERANCE: f64;
    fn add_constants(&self, _b: &mut PlantTableBuilder) {}
    fn add_parameters(&self, b: &mut PlantTableBuilder, start: &[f64]);
    fn add_inputs(&self, b: &mut PlantTableBuilder);
    fn add_outputs(&self, b: &mut PlantTableBuilder);
    fn add_states(&self, b: &mut PlantTableBuilder);
    fn add_plugs(&self, b: &mut PlantTableBuilder);
}

impl Tabled for RigidChaser {
    const CHOICE: u32 = RIGID;
    const TOLERANCE: f64 = CAPTURE_TOLERANCE;
    fn add_parameters(&self, b: &mut PlantTableBuilder, start: &[f64]) {
        b.parameters(&ChaserParameters::list(&()), start);
    }
    fn add_inputs(&self, b: &mut PlantTableBuilder) {
        b.inputs(&ChaserInputs::list(&()));
    }
    fn add_outputs(&self, b: &mut PlantTableBuilder) {
        b.outputs(&ChaserOutputs::list(&()));
    }
    fn add_states(&self, b: &mut PlantTableBuilder) {
        b.moved(&ChaserStates::list(&()));
    }
    fn add_plugs(&self, b: &mut PlantTableBuilder) {
        b.plug("chaser", "What drives the chaser", &[("force", "chaserForce"), ("torque", "chaserTorque")]);
    }
}

impl Tabled for PlanarManipulator {
    const CHOICE: u32 = PLANAR;
    const TOLERANCE: f64 = TOLERANCE;
    fn add_constants(&self, b: &mut PlantTableBuilder) {
        arm::constants(b, self);
    }
    fn add_parameters(&self, b: &mut PlantTableBuilder, start: &[f64]) {
        b.parameters(&parameter::list(&self.layout()), start);
        b.effect_parts(self.effects(), PlantKind::Arm, &[builder::PARAMETER]);
    }
    fn add_inputs(&self, b: &mut PlantTableBuilder) {
        b.inputs(&input::list(&self.layout()));
        b.effect_parts(self.effects(), PlantKind::Arm, &[builder::INPUT]);
        b.retell("tipForce", "On the last link at its tip in addition to the contact, inertial frame");
        b.retell("tipTorque", "On the last link in addition to the contact");
    }
    fn add_outputs(&self, b: &mut PlantTableBuilder) {
        b.outputs(&output::list(&self.layout()));
        b.effect_parts(self.effects(), PlantKind::Arm, &[builder::OUTPUT]);
        b.retell("linearMomentum", "Of manipulator, target and a ball on a mount");
        b.retell(
            "angularMomentum",
            "Of manipulator, target and a ball on a mount, about the inertial origin, rotors included",
        );
        b.retell("kineticEnergy", "Of manipulator, target and a ball on a mount, rotors included");
        b.retell("potentialEnergy", "Of the joints, V (eq. 7)");
    }
    fn add_states(&self, b: &mut PlantTableBuilder) {
        b.moved(&states(&self.layout()));
        b.effect_parts(self.effects(), PlantKind::Arm, &[builder::STATE]);
    }
    fn add_plugs(&self, b: &mut PlantTableBuilder) {
        arm::drive(b);
    }
}

fn scene<C: Tabled>(m: &CaptureScene<C>) -> ModelTable {
    let experiment = TableExperiment { stop_time: 30.0, tolerance: C::TOLERANCE, step_size: 0.05 };
    let text =
        "Capture in the plane: chaser, gripper and target in one (dynamics of on-orbit capture, eq. 20-22)";
    let mut b = PlantTableBuilder::new("CaptureScene", text, experiment);
    let (s, chaser, start) = (m.structure(), m.chaser(), m.defaults());
    constants(&mut b, "CaptureScene", &[&[C::CHOICE as usize][..], &numbers(s)].concat());
    chaser.add_constants(&mut b);
    let own = chaser.sizes().parameters;
    let (of_gripper, rest) = start.split_at(Parameters::new(s).count);
    b.parameters(&Parameters::list(s), of_gripper);
    chaser.add_parameters(&mut b, &rest[..own]);
    b.parameters(&SceneParameters::list(&()), &rest[own..]);
    b.inputs(&Command::list(s));
    chaser.add_inputs(&mut b);
    b.outputs(&Outputs::list(s));
    chaser.add_outputs(&mut b);
    b.outputs(&SceneOutputs::list(&()));
    b.moved(&States::list(s));
    chaser.add_states(&mut b);
    b.moved(&SceneStates::list(&()));
    chaser.add_plugs(&mut b);
    b.finish(m.sizes().indicators)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::structure::CHASES;

    /// Every model with several structures.
    pub(crate) fn structures() -> Vec<Configuration> {
        let of = |model: &str, structure: &[(&str, u32)]| Configuration {
            structure: structure.iter().map(|(name, value)| ((*name).to_owned(), vec![*value])).collect(),
            ..Configuration::of(model)
        };
        let mut all = vec![of("FreeBody", &[]), of("FreeBody", &[(PORTS, 3)])];
        all.push(of("CaptureScene", &[(CHASES, PLANAR)]));
        all.push(Configuration {
            joint_flexible: vec![false, true],
            ..of("CaptureScene", &[(CHASES, PLANAR), (BALLS, 1), (MOUNTED, 2)])
        });
        for model in ["GripperContact", "CaptureScene"] {
            all.push(of(model, &[]));
            all.push(of(model, &[(BALLS, 5), (CLOSES, 2), (TOUCHES, 2)]));
            all.push(of(model, &[(BALLS, 1), (MOUNTED, 2), (TOUCHES, 1)]));
            all.push(of(model, &[(CLOSES, 3)]));
            all.push(of(model, &[(BALLS, 7), (MOUNTED, 3), (TOUCHES, 3)]));
            all.push(of(model, &[(BALLS, 5), (MOUNTED, 3), (CLOSES, 3)]));
            all.push(of(model, &[(CLOSES, 2), (MOUNTED, 3), (TOUCHES, 2)]));
        }
        all
    }

    /// The contact and the target are in what the arm's own descriptions say of the arm alone.
    #[test]
    fn an_arm_in_a_scene_says_that_it_is_not_alone() {
        let scene = build(&structures()[2]).unwrap();
        assert!(matches!(scene, Contact::ArmScene(_)));
        let table = scene.table();
        for name in ["tipForce", "tipTorque"] {
            let told = &table.variables.iter().find(|v| v.name == name).unwrap().description;
            assert!(told.contains("in addition to the contact"), "{name}: {told}");
        }
        for name in ["linearMomentum", "angularMomentum", "kineticEnergy"] {
            let told = &table.variables.iter().find(|v| v.name == name).unwrap().description;
            assert!(told.contains("target"), "{name}: {told}");
        }
    }

    #[test]
    fn structures_that_cannot_be_had_are_refused() {
        let refused = |model: &str, structure: &[(&str, &[u32])]| {
            let structure = structure.iter().map(|(n, v)| ((*n).to_owned(), v.to_vec())).collect();
            build(&Configuration { structure, ..Configuration::of(model) }).unwrap_err()
        };
        for (model, structure, said) in [
            ("FreeBody", &[(BALLS, &[3][..])][..], "no `numberOfBalls` to choose; it has numberOfPorts"),
            ("FreeBody", &[(PORTS, &[9])], "one of 1 to 8"),
            ("GripperContact", &[(CLOSES, &[4])], "one of schedule, command, motor"),
            ("GripperContact", &[(CLOSES, &[])], "one of schedule, command"),
            ("CaptureScene", &[(MOUNTED, &[2])], "numberOfBalls=1"),
        ] {
            let why = refused(model, structure);
            assert!(why.contains(said), "{why}");
        }
        let with = |c: Configuration| build(&c).unwrap_err();
        assert!(
            with(Configuration { effects: vec!["backlash".into()], ..Configuration::of("FreeBody") })
                .contains("`backlash`")
        );
        assert!(
            with(Configuration { joint_flexible: vec![true], ..Configuration::of("CaptureScene") })
                .contains("no joints")
        );
    }
}
