//! `FreeBody`, `GripperContact` and `CaptureScene`: variable tables and configurations.

use crate::builder::Builder;
use crate::experiment::TOLERANCE;
use crate::structure::{BALLS, CLOSES, MOUNTED, PORTS, TOUCHES, Wanted, choices, chosen};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{Experiment, Kind, ModelTable};
use trueup_models::contact::layout::{
    BodyInputs, BodyOutputs, BodyParameters, BodyStates, Command, HostParameters, Outputs, Parameters, Poses,
    SceneInputs, SceneOutputs, SceneParameters, SceneStates, States,
};
use trueup_models::contact::{Against, CaptureScene, Closing, FreeBody, GripperContact, Mount, Structure};
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
    /// `CaptureScene`.
    Scene(CaptureScene),
}

trueup_numerics::delegate_hybrid!(Contact {
    Contact::Body(m) => m,
    Contact::Gripper(m) => m,
    Contact::Scene(m) => m
});

/// Bits of warnings.
const OVERLAP: u32 = 1;
const CLIPPED: u32 = 2;

/// The model of a configuration.
pub(crate) fn build(c: &Configuration) -> Result<Contact, String> {
    if let Some(effect) = c.effects.first() {
        return Err(format!("no effect acts in {}, `{effect}` neither", c.model));
    }
    if !c.joint_flexible.is_empty() {
        return Err(format!("{} has no joints: leave out which are flexible", c.model));
    }
    let chosen = chosen(c)?;
    if c.model == "FreeBody" {
        return FreeBody::new(chosen(PORTS).unwrap_or(1)).map(Contact::Body);
    }
    let structure = Structure {
        balls: chosen(BALLS).unwrap_or(Structure::default().balls),
        closing: match chosen(CLOSES) {
            Some(2) => Closing::Command,
            Some(3) => Closing::Motor,
            _ => Closing::Schedule,
        },
        mount: if chosen(MOUNTED) == Some(2) { Mount::Elastic } else { Mount::Rigid },
        against: if chosen(TOUCHES) == Some(2) { Against::Plate } else { Against::Ball },
    };
    if c.model == "GripperContact" {
        GripperContact::new(structure).map(Contact::Gripper)
    } else {
        CaptureScene::new(structure).map(Contact::Scene)
    }
}

impl Contact {
    pub(crate) fn table(&self) -> ModelTable {
        match self {
            Self::Body(m) => body(m),
            Self::Gripper(m) => gripper(m),
            Self::Scene(m) => scene(m),
        }
    }
    pub(crate) fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        match self {
            Self::Body(_) => Ok(()),
            Self::Gripper(m) => m.check(p),
            Self::Scene(m) => m.check(p),
        }
    }
    pub(crate) fn watch(&self, at: &At<'_, f64>, said: u32) -> Option<(u32, String)> {
        let fresh = |bit: u32| said & bit == 0;
        let overlap = || match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.overlap(at),
            Self::Scene(m) => m.overlap(at),
        };
        let clipped = || match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.clipped(at),
            Self::Scene(m) => m.clipped(at),
        };
        let first = fresh(OVERLAP).then(overlap).flatten().map(|text| (OVERLAP, text));
        first.or_else(|| fresh(CLIPPED).then(clipped).flatten().map(|text| (CLIPPED, text)))
    }
    pub(crate) fn long_step(&self, h: f64, p: &[f64]) -> Option<String> {
        match self {
            Self::Gripper(m) => m.long_step(h, p),
            // What the others integrate is theirs alone.
            Self::Body(_) | Self::Scene(_) => None,
        }
    }
    pub(crate) fn singular(&self, at: &At<'_, f64>) -> Option<String> {
        match self {
            Self::Body(_) => None,
            Self::Gripper(m) => m.fault(at),
            Self::Scene(m) => m.fault(at),
        }
    }
}

/// What is fixed when packed.
fn constants(b: &mut Builder, model: &str, values: &[usize]) {
    b.constant("dimension", Kind::Integer, &[], &[2.0], "The model moves in the plane");
    for (choice, value) in choices(model).iter().zip(values) {
        let kind = match choice.wanted {
            Wanted::Count(_) => Kind::Integer,
            Wanted::Item(items) => b.items(items),
        };
        let text = format!("{} (fixed when packed)", choice.text);
        b.constant(choice.name, kind, &[], &[*value as f64], &text);
    }
}

/// In the order of the model's choices.
fn numbers(s: &Structure) -> [usize; 4] {
    [s.balls, s.closing as usize + 1, s.mount as usize + 1, s.against as usize + 1]
}

fn body(m: &FreeBody) -> ModelTable {
    let experiment = Experiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let mut b =
        Builder::new("FreeBody", "Rigid body that floats in the plane, with docking points", experiment);
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
    let experiment = Experiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let text = "Contact of a gripper of balls with a docking port (dynamics of on-orbit capture, eq. 20-22)";
    let mut b = Builder::new("GripperContact", text, experiment);
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

fn scene(m: &CaptureScene) -> ModelTable {
    let experiment = Experiment { stop_time: 30.0, tolerance: TOLERANCE, step_size: 0.05 };
    let text =
        "Capture in the plane: chaser, gripper and target in one (dynamics of on-orbit capture, eq. 20-22)";
    let mut b = Builder::new("CaptureScene", text, experiment);
    let s = m.structure();
    constants(&mut b, "CaptureScene", &numbers(s));
    let parameters = [Parameters::list(s), SceneParameters::list(&())].concat();
    b.parameters(&parameters, &m.defaults());
    b.inputs(&Command::list(s));
    b.inputs(&SceneInputs::list(&()));
    b.outputs(&[Outputs::list(s), SceneOutputs::list(&())].concat());
    b.moved(&[States::list(s), SceneStates::list(&())].concat());
    b.plug("chaser", "What drives the chaser", &[("force", "chaserForce"), ("torque", "chaserTorque")]);
    b.finish(m.sizes().indicators)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Every model with several structures.
    pub(crate) fn structures() -> Vec<Configuration> {
        let of = |model: &str, structure: &[(&str, u32)]| Configuration {
            structure: structure.iter().map(|(name, value)| ((*name).to_owned(), vec![*value])).collect(),
            ..Configuration::of(model)
        };
        let mut all = vec![of("FreeBody", &[]), of("FreeBody", &[(PORTS, 3)])];
        for model in ["GripperContact", "CaptureScene"] {
            all.push(of(model, &[]));
            all.push(of(model, &[(BALLS, 5), (CLOSES, 2), (TOUCHES, 2)]));
            all.push(of(model, &[(BALLS, 1), (MOUNTED, 2), (TOUCHES, 1)]));
            all.push(of(model, &[(CLOSES, 3)]));
        }
        all
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
