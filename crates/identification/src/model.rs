//! The plants with their variables by name: what recordings, cases and results speak of.

use trueup_models::arm::{
    self, BASE, BASE_CHOICE, PAYLOAD, PayloadParameter, PlanarManipulator, Replay, layout, rotor,
};
use trueup_models::effect::EffectError;
use trueup_models::effect::{self, EffectSet, Role as Kinds, Scope};
use trueup_models::joint::{self, TwoMassJoint};
use trueup_models::presets;
use trueup_numerics::Scalar;
use trueup_signals::{Case, Role, Takes, Value, Variable, base_name, element_name};

use crate::plant::Plant;

mod known;

/// Which plant, how it is built, what acts in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// `TwoMassJoint` or `PlanarManipulator`.
    pub model: String,
    /// Which joints have a spring; one entry per joint.
    pub flexible: Vec<bool>,
    /// An arm's base stays where it begins.
    pub fixed_base: bool,
    /// Ids of its effects.
    pub effects: Vec<String>,
    /// Joints (from 0) whose motor moves as measured, whatever torque that takes; for the arm.
    pub led: Vec<usize>,
    /// Which link carries a body more, from 0; for the arm.
    pub payload: Option<usize>,
}

/// A model that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// No such plant.
    #[error(
        "identification knows TwoMassJoint and PlanarManipulator, not `{0}`; name one of them in `model`"
    )]
    Unknown(String),
    /// Its structure.
    #[error("{0}")]
    Structure(String),
    /// A parameter.
    #[error("{name}: {what}")]
    Parameter {
        /// Which.
        name: String,
        /// What is wrong, and the mend.
        what: String,
    },
}

impl From<EffectError> for ModelError {
    fn from(e: EffectError) -> Self {
        Self::Structure(e.to_string())
    }
}

/// A scalar variable, an array's element under its indexed name.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// FMU variable (`stiffness`, `jointStiffness[1]`).
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
enum Kind {
    Joint(TwoMassJoint),
    Arm(PlanarManipulator),
    Led(Replay),
}

trueup_numerics::delegate_hybrid!(Kind { Kind::Joint(m) => m, Kind::Arm(m) => m, Kind::Led(m) => m });

/// A plant that can be simulated, with its variables by name, each list in the order of the model's values.
#[derive(Clone, Debug)]
pub struct Model {
    kind: Kind,
    structure: Structure,
    parameters: Vec<Quantity>,
    inputs: Vec<Quantity>,
    outputs: Vec<Quantity>,
}

trueup_numerics::delegate_hybrid!(Model { Model { kind, .. } => kind });

/// Variables by name, each list in the order of the values.
pub trait Named {
    /// Parameters.
    fn parameters(&self) -> &[Quantity];
    /// Inputs.
    fn inputs(&self) -> &[Quantity];
    /// Outputs.
    fn outputs(&self) -> &[Quantity];
    /// Whether an output is compared with its readings; a flag is shown, not fitted.
    fn compares(&self, output: usize) -> bool {
        !self.outputs()[output].unit.is_empty()
    }
    /// A doubt of that parameter is in its own unit: it has no size that a share could be of, as angles to turn by and payloads.
    fn absolute_doubt(&self, _parameter: usize) -> bool {
        false
    }
    /// Index of a parameter.
    fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters().iter().position(|q| q.name == name)
    }
    /// Index of an input.
    fn input(&self, name: &str) -> Option<usize> {
        self.inputs().iter().position(|q| q.name == name)
    }
    /// Index of an output.
    fn output(&self, name: &str) -> Option<usize> {
        self.outputs().iter().position(|q| q.name == name)
    }
    /// Parameters that belong to one array, or the one of that name.
    fn named(&self, name: &str) -> Vec<&Quantity> {
        self.parameters().iter().filter(|q| q.name == name || base_name(&q.name) == name).collect()
    }
}

impl Named for Model {
    fn absolute_doubt(&self, parameter: usize) -> bool {
        let carried = PayloadParameter::named(&self.parameters[parameter].name);
        self.effects().absolute_doubt(parameter) || carried.is_some_and(|p| p.absolute_doubt)
    }
    fn parameters(&self) -> &[Quantity] {
        &self.parameters
    }
    fn inputs(&self) -> &[Quantity] {
        &self.inputs
    }
    fn outputs(&self) -> &[Quantity] {
        &self.outputs
    }
}

/// Where one coordinate of the plant begins: indices of parameters, and of the outputs that show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// Parameter: value at the start.
    pub angle: usize,
    /// Parameter: rate at the start.
    pub velocity: usize,
    /// Output that shows its value.
    pub angle_output: usize,
    /// Output that shows its rate.
    pub velocity_output: usize,
    /// Another coordinate that it stays close to (behind a spring), by index, and whether that one is `gearRatio` times
    /// as large.
    pub follows: Option<(usize, bool)>,
}

impl Plant for Model {
    fn affine(&self) -> bool {
        matches!(&self.kind, Kind::Joint(m) if m.affine())
    }
    fn rest<T: Scalar>(&self, p: &mut [T], u: &[T]) {
        if let Kind::Joint(m) = &self.kind {
            m.rest(p, u);
        }
    }
}

/// Least value of each parameter of the joint, in their order.
const JOINT_LEAST: [f64; joint::parameter::COUNT] = [
    0.0,
    0.0,
    0.0,
    f64::NEG_INFINITY,
    0.0,
    0.0,
    0.0,
    0.0,
    0.0,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
];
const FRICTION: [(&str, &str); 3] =
    [("coulombFriction", "N.m"), ("staticFriction", "N.m"), ("viscousFriction", "N.m.s/rad")];

/// Unit and least value of a variable of the arm.
fn arm_unit(base: &str) -> (&'static str, f64) {
    let free = f64::NEG_INFINITY;
    match base {
        "baseMass" | "linkMass" => ("kg", 0.0),
        "baseInertia" | "linkInertia" | "motorInertia" => ("kg.m2", 0.0),
        "linkLength" => ("m", 0.0),
        "mountPosition" | "linkCenterOfMass" | "initialBasePosition" | "basePosition" | "tipPosition" => {
            ("m", free)
        }
        "gearRatio" => ("1", 1.0),
        "jointStiffness" => ("N.m/rad", 0.0),
        "jointDamping" => ("N.m.s/rad", 0.0),
        "initialBaseVelocity" | "baseVelocity" | "tipVelocity" => ("m/s", free),
        "initialBaseAttitude"
        | "initialJointAngle"
        | "initialMotorAngle"
        | "baseAttitude"
        | "jointAngle"
        | "motorAngle"
        | "tipAttitude" => ("rad", free),
        "initialBaseRate"
        | "initialJointVelocity"
        | "initialMotorVelocity"
        | "baseRate"
        | "jointVelocity"
        | "motorVelocity"
        | "tipRate" => ("rad/s", free),
        "motorCoupling" => ("", 1.0),
        "jointTorque" | "baseTorque" | "tipTorque" | "frictionTorque" => ("N.m", free),
        "baseForce" | "tipForce" => ("N", free),
        "linearMomentum" => ("kg.m/s", free),
        "angularMomentum" => ("kg.m2/s", free),
        "kineticEnergy" | "potentialEnergy" => ("J", free),
        "gravity" => ("m/s2", free),
        _ => ("", free),
    }
}

/// Variables that are one number although their length could be 1 of an array.
fn scalar(base: &str) -> bool {
    base.starts_with("base") && !matches!(base, "basePosition" | "baseVelocity" | "baseForce")
        || matches!(
            base,
            "initialBaseAttitude"
                | "initialBaseRate"
                | "motorCoupling"
                | "tipAttitude"
                | "tipRate"
                | "tipTorque"
                | "angularMomentum"
                | "kineticEnergy"
                | "potentialEnergy"
        )
}

/// What a case says of its base.
///
/// # Errors
/// No item of [`BASE`].
pub fn has_fixed_base(case: &Case) -> Result<bool, ModelError> {
    match case.parameters.get(BASE_CHOICE) {
        None => Ok(false),
        Some(Value::Text(item)) if BASE.items.iter().any(|i| i.0 == item) => Ok(*item != BASE.items[0].0),
        Some(other) => {
            let what = format!("{other} is none of free, fixed; name one of them");
            Err(ModelError::Parameter { name: BASE_CHOICE.into(), what })
        }
    }
}

fn quantity(name: String, unit: &'static str, min: f64) -> Quantity {
    Quantity { name, unit, min, max: f64::INFINITY }
}

/// Names with their number of elements for n links.
type Layout = [(&'static str, fn(usize) -> usize)];

fn arm_list(names: &Layout, n: usize) -> Vec<Quantity> {
    let mut all = Vec::new();
    for (base, len) in names {
        let (unit, min) = arm_unit(base);
        for k in 0..len(n) {
            let name = match *base {
                _ if scalar(base) => (*base).to_owned(),
                "linkCenterOfMass" => element_name(base, &[k / 2 + 1, k % 2 + 1]),
                _ => element_name(base, &[k + 1]),
            };
            all.push(quantity(name, unit, min));
        }
    }
    all
}

/// Adds the effects' own variables; storage is variable by variable, site by site.
fn add_effects(set: &EffectSet, plant: effect::Plant, model: &mut Model) {
    for e in set.iter() {
        let spec = e.spec();
        let scope = e.choice.scope();
        let indexed =
            plant == effect::Plant::Arm && scope == Scope::Joint || scope == Scope::Channel && e.sites > 1;
        let name = |base: &str, k: usize| {
            if indexed { element_name(base, &[k + 1]) } else { base.to_owned() }
        };
        for p in e.choice.parameters() {
            model.parameters.extend((0..e.sites).map(|k| Quantity {
                name: name(&e.choice.variable(p.name), k),
                unit: e.choice.unit(p.unit),
                min: p.min,
                max: p.max,
            }));
        }
        for u in spec.inputs {
            let all = (0..e.sites).map(|k| quantity(name(u.name_in(plant), k), u.unit, f64::NEG_INFINITY));
            model.inputs.extend(all);
        }
        for y in spec.outputs {
            let all = (0..e.sites).map(|k| quantity(name(y.name_in(plant), k), y.unit, f64::NEG_INFINITY));
            model.outputs.extend(all);
        }
    }
}

impl Model {
    /// A plant of that structure.
    ///
    /// # Errors
    /// An unknown model or effect, a number of joints that it cannot have, joints that cannot be led.
    pub fn new(structure: Structure) -> Result<Self, ModelError> {
        let plain = |list: &[(&str, &'static str)]| -> Vec<Quantity> {
            list.iter().map(|(name, unit)| quantity((*name).into(), unit, f64::NEG_INFINITY)).collect()
        };
        match structure.model.as_str() {
            "TwoMassJoint" => {
                let [flexible] = structure.flexible[..] else {
                    let n = structure.flexible.len();
                    return Err(ModelError::Structure(format!(
                        "jointFlexible has {n} values, TwoMassJoint has one joint; write jointFlexible = true"
                    )));
                };
                let joint = TwoMassJoint::new(flexible, &structure.effects)?;
                let set = joint.effects().clone();
                let parameters = joint::parameter::NAMES.iter().zip(JOINT_LEAST);
                let parameters = parameters.map(|((name, unit), min)| quantity((*name).into(), unit, min));
                let mut model = Self {
                    kind: Kind::Joint(joint),
                    structure,
                    parameters: parameters.collect(),
                    inputs: plain(&joint::input::NAMES),
                    outputs: plain(&joint::output::NAMES),
                };
                add_effects(&set, effect::Plant::Joint, &mut model);
                Ok(model)
            }
            "PlanarManipulator" => {
                let n = structure.flexible.len();
                let Structure { fixed_base, flexible, effects, .. } = &structure;
                let arm = PlanarManipulator::on_base(*fixed_base, flexible, effects)
                    .map_err(|e| ModelError::Structure(e.to_string()))?
                    .with_payload(structure.payload);
                if let Some(link) = structure.payload.filter(|l| *l >= n) {
                    let what = format!("there is no link {}; the model has {n}", link + 1);
                    return Err(ModelError::Parameter { name: "payload.link".into(), what });
                }
                let (set, friction) = (arm.effects().clone(), arm.has_friction());
                let mut model = Self {
                    kind: Kind::Arm(arm.clone()),
                    structure,
                    parameters: arm_list(layout::parameter::NAMES, n),
                    inputs: arm_list(layout::input::NAMES, n),
                    outputs: arm_list(layout::output::NAMES, n),
                };
                let joints = |base: &str| (0..n).map(|k| element_name(base, &[k + 1])).collect::<Vec<_>>();
                if friction {
                    for (base, unit) in FRICTION {
                        let all = joints(base).into_iter().map(|name| quantity(name, unit, 0.0));
                        model.parameters.extend(all);
                    }
                    for (base, unit) in [("frictionTorque", "N.m"), ("sticking", "")] {
                        let all = joints(base).into_iter().map(|n| quantity(n, unit, f64::NEG_INFINITY));
                        model.outputs.extend(all);
                    }
                }
                add_effects(&set, effect::Plant::Arm, &mut model);
                if arm.payload().is_some() {
                    model.parameters.extend(PAYLOAD.iter().map(|p| quantity(p.name.into(), p.unit, p.min)));
                }
                if !model.structure.led.is_empty() {
                    let led = model.structure.led.clone();
                    let replay = Replay::new(arm, &led).ok_or_else(|| {
                        ModelError::Structure(
                            "a manipulator with friction cannot follow measured motion; record jointTorque"
                                .into(),
                        )
                    })?;
                    let all = led.iter().map(|j| element_name("motorAcceleration", &[j + 1]));
                    model.inputs.extend(all.map(|n| quantity(n, "rad/s2", f64::NEG_INFINITY)));
                    model.kind = Kind::Led(replay);
                }
                Ok(model)
            }
            other => Err(ModelError::Unknown(other.into())),
        }
    }

    /// The plant that a case names, with the effects that it knows to be there, and these.
    ///
    /// # Errors
    /// As [`Model::new`]; a `jointFlexible` that is no truth value; a known effect whose size is not given.
    pub fn of_case(case: &Case, effects: &[&str]) -> Result<Self, ModelError> {
        let declared = case.elements("jointFlexible");
        let flexible: Option<Vec<bool>> = declared.iter().map(|v| v.boolean()).collect();
        let mut flexible = flexible.ok_or_else(|| ModelError::Parameter {
            name: "jointFlexible".into(),
            what: "it is true or false; write jointFlexible = true, for an arm one per joint".into(),
        })?;
        if flexible.is_empty() {
            flexible = if case.model == "TwoMassJoint" { vec![true] } else { vec![true, false, false] };
        }
        let mut all: Vec<String> = Vec::new();
        for id in case.known_effects().into_iter().chain(effects.iter().copied()) {
            if !all.iter().any(|known| known == id) {
                all.push(id.to_owned());
            }
        }
        let fixed_base = has_fixed_base(case)?;
        let model = case.model.clone();
        let model = Self::new(Structure {
            model,
            flexible,
            fixed_base,
            effects: all,
            led: Vec::new(),
            payload: case.payload.map(|l| l - 1),
        })?;
        known::check(&model, case)?;
        Ok(model)
    }

    /// The same plant with other effects.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn with_effects(&self, effects: &[&str]) -> Result<Self, ModelError> {
        let effects = effects.iter().map(|e| (*e).to_owned()).collect();
        Self::new(Structure { effects, ..self.structure.clone() })
    }
    /// The same arm, the motors of these joints (from 0) led along their measured motion.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn with_led(&self, led: &[usize]) -> Result<Self, ModelError> {
        Self::new(Structure { led: led.to_vec(), ..self.structure.clone() })
    }

    /// How it is built.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }
    /// Its joint, if it is one.
    pub fn joint(&self) -> Option<&TwoMassJoint> {
        if let Kind::Joint(m) = &self.kind { Some(m) } else { None }
    }
    /// Its arm, if it is one.
    pub fn arm(&self) -> Option<&PlanarManipulator> {
        match &self.kind {
            Kind::Joint(_) => None,
            Kind::Arm(m) => Some(m),
            Kind::Led(m) => Some(m.arm()),
        }
    }
    /// Parameters in the order of their values.
    pub fn parameters(&self) -> &[Quantity] {
        &self.parameters
    }
    /// Inputs in their order.
    pub fn inputs(&self) -> &[Quantity] {
        &self.inputs
    }
    /// Outputs in their order.
    pub fn outputs(&self) -> &[Quantity] {
        &self.outputs
    }
    /// Index of a parameter.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|q| q.name == name)
    }
    /// Index of an input.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|q| q.name == name)
    }
    /// Index of an output.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|q| q.name == name)
    }

    /// The inputs that drive the motors: of a joint that holds an angle by itself, its reference.
    fn driving(&self) -> std::ops::Range<usize> {
        let joints = self.structure.flexible.len();
        let first = match (self.effects().servo(), &self.kind) {
            (Some(servo), _) => servo.begin.inputs,
            (None, Kind::Joint(_)) => joint::input::MOTOR_CURRENT,
            (None, _) => arm::input::joint_torque(joints),
        };
        first..first + joints
    }
    /// The variables as the reader of recordings and cases wants them.
    pub fn variables(&self) -> Vec<Variable> {
        let driving = self.driving();
        let list = |all: &[Quantity], role| {
            let made = all.iter().enumerate().map(|(i, q)| Variable {
                min: q.min.is_finite().then_some(q.min),
                max: q.max.is_finite().then_some(q.max),
                takes: if q.name == "motorCoupling" { Takes::Item } else { Takes::Number },
                positive: role == Role::Parameter && self.divides_by(&q.name),
                drives: role == Role::Input && driving.contains(&i),
                ..Variable::new(&q.name, q.unit, role)
            });
            made.collect::<Vec<_>>()
        };
        let mut all = list(&self.parameters, Role::Parameter);
        all.extend(list(&self.inputs, Role::Input));
        all.extend(list(&self.outputs, Role::Output));
        // Structural choices stand among the parameters of a case.
        let choice =
            |name: &str| Variable { takes: Takes::Boolean, ..Variable::new(name, "", Role::Parameter) };
        match &self.kind {
            Kind::Joint(_) => all.push(choice("jointFlexible")),
            _ => {
                let links = self.structure.flexible.len();
                all.extend((1..=links).map(|j| choice(&element_name("jointFlexible", &[j]))));
                let n = Some(links as f64);
                let links = Variable::new("numberOfLinks", "", Role::Parameter);
                all.push(Variable { min: n, max: n, ..links });
                let base = Variable::new(BASE_CHOICE, "", Role::Parameter);
                all.push(Variable { takes: Takes::Item, ..base });
            }
        }
        all
    }

    /// A parameter that has to be above 0 for the equations to have a solution: inertias of what moves by itself, gear ratios.
    fn divides_by(&self, name: &str) -> bool {
        match base_name(name) {
            "baseMass" | "baseInertia" => !self.structure.fixed_base,
            "gearRatio" | "loadInertia" | "linkMass" | "linkInertia" => true,
            // The rotor of a rigid joint may be neglected.
            "motorInertia" => match self.arm() {
                None => true,
                Some(arm) => (arm.flexible().iter().enumerate())
                    .any(|(j, flexible)| *flexible && name == element_name("motorInertia", &[j + 1])),
            },
            _ => false,
        }
    }

    /// Start values of all parameters: DELIAN's joint 1 or CBK PAN's test-bed; sizes of effects as if they were not there,
    /// shapes as they are packed.
    pub fn defaults(&self) -> Vec<f64> {
        let n = self.structure.flexible.len();
        let (mut p, friction) = match self.arm() {
            None => (presets::delian(1).unwrap_or_default().to_vec(), 0),
            Some(arm) => {
                (presets::cbk_pan(arm.flexible()), if arm.has_friction() { FRICTION.len() * n } else { 0 })
            }
        };
        p.resize(p.len() + friction, 0.0);
        for e in self.effects().iter() {
            for s in e.choice.parameters() {
                let start = match (s.role, self.plant()) {
                    (Kinds::Amplitude, _) => s.neutral,
                    (_, effect::Plant::Joint) => s.joint_start,
                    (_, effect::Plant::Arm) => s.arm_start,
                };
                p.resize(p.len() + e.sites, start);
            }
        }
        p.resize(p.len() + self.arm().and_then(PlanarManipulator::payload).map_or(0, |_| PAYLOAD.len()), 0.0);
        p
    }
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        match &self.kind {
            Kind::Joint(m) => m.effects(),
            Kind::Arm(m) => m.effects(),
            Kind::Led(m) => m.arm().effects(),
        }
    }
    /// Which plant it is.
    pub fn plant(&self) -> effect::Plant {
        if self.joint().is_some() { effect::Plant::Joint } else { effect::Plant::Arm }
    }

    /// All parameters by name from another list (a case's, a recording's), the rest from `base`.
    ///
    /// # Errors
    /// A value that is no number, or none that the parameter can have.
    pub fn set<'a>(
        &self,
        base: &[f64],
        given: impl IntoIterator<Item = (&'a String, &'a Value)>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut p = base.to_vec();
        let mut angles = Vec::new();
        for (name, value) in given {
            let Some(i) = self.parameter(name) else { continue };
            let wrong = |what: String| ModelError::Parameter { name: name.clone(), what };
            p[i] = match value {
                Value::Text(item) if name == "motorCoupling" => match item.as_str() {
                    "paper" => rotor::PAPER,
                    "geared" => rotor::GEARED,
                    _ => return Err(wrong(format!("`{item}` is none of paper, geared; name one of them"))),
                },
                _ => value.number().filter(|v| v.is_finite()).ok_or_else(|| {
                    wrong(format!("{value} is no number; write its value in the FMU's unit, without quotes"))
                })?,
            };
            let q = &self.parameters[i];
            if p[i] <= 0.0 && self.divides_by(name) {
                let mend = "give that of the real system, or remove the line to take the preset's";
                return Err(wrong(format!("it is {} and has to be above 0; {mend}", p[i])));
            }
            if p[i] < q.min || p[i] > q.max {
                return Err(wrong(format!(
                    "{} is outside {} .. {}; give a value within",
                    p[i], q.min, q.max
                )));
            }
            angles.push(i);
        }
        // What a link carries is at its end, unless it is said to be elsewhere.
        if let (Some(at), Some(link)) = (self.parameter(PAYLOAD[1].name), self.structure.payload)
            && !angles.contains(&at)
            && angles.iter().any(|i| self.parameters[*i].name == PAYLOAD[0].name)
        {
            p[at] = p[layout::parameter::link_length(self.structure.flexible.len()) + link];
        }
        // Motors that are not set stay with their joints, springs unstrained.
        for c in self.coordinates() {
            if let (Some((other, geared)), true) = (c.follows, self.arm().is_some()) {
                let o = self.coordinates()[other];
                for (own, of) in [(c.angle, o.angle), (c.velocity, o.velocity)] {
                    if !geared && !angles.contains(&own) {
                        p[own] = p[of];
                    }
                }
            }
        }
        Ok(p)
    }

    /// Parameters of this plant from those of another one by name; what that one lacks from `defaults`.
    pub fn carry(&self, other: &Model, values: &[f64]) -> Vec<f64> {
        let mut p = self.defaults();
        for (q, v) in other.parameters.iter().zip(values) {
            if let Some(i) = self.parameter(&q.name) {
                p[i] = *v;
            }
        }
        p
    }

    /// What `identify` estimates unless the case says otherwise.
    pub fn usual(&self) -> Vec<String> {
        match &self.kind {
            Kind::Joint(m) => {
                let spring: &[&str] = if m.flexible() { &["stiffness", "damping"] } else { &[] };
                let friction = ["coulombFriction", "viscousFriction", "staticFriction"];
                spring.iter().chain(&friction).map(|s| (*s).to_owned()).collect()
            }
            _ => {
                let flexible = (0..self.structure.flexible.len()).filter(|j| self.structure.flexible[*j]);
                let each = |base: &'static str| flexible.clone().map(move |j| element_name(base, &[j + 1]));
                ["motorInertia", "jointStiffness", "jointDamping"].into_iter().flat_map(each).collect()
            }
        }
    }

    /// Its coordinates, each with where it begins and what shows it; those of a base that is fixed do not move.
    pub fn coordinates(&self) -> Vec<Coordinate> {
        use trueup_models::arm::{output as ao, parameter as ap};
        use trueup_models::joint::{output as jo, parameter as jp};
        if let Kind::Joint(m) = &self.kind {
            let motor = Coordinate {
                angle: jp::INITIAL_MOTOR_ANGLE,
                velocity: jp::INITIAL_MOTOR_VELOCITY,
                angle_output: jo::MOTOR_ANGLE,
                velocity_output: jo::MOTOR_VELOCITY,
                follows: None,
            };
            let load = Coordinate {
                angle: jp::INITIAL_LOAD_ANGLE,
                velocity: jp::INITIAL_LOAD_VELOCITY,
                angle_output: jo::LOAD_ANGLE,
                velocity_output: jo::LOAD_VELOCITY,
                follows: Some((0, true)),
            };
            return if m.flexible() { vec![motor, load] } else { vec![motor] };
        }
        let n = self.structure.flexible.len();
        let base = !self.structure.fixed_base;
        let mut all: Vec<Coordinate> = (0..if base { 2 } else { 0 })
            .map(|i| Coordinate {
                angle: ap::initial_base_position(n) + i,
                velocity: ap::initial_base_velocity(n) + i,
                angle_output: ao::base_position(n) + i,
                velocity_output: ao::base_velocity(n) + i,
                follows: None,
            })
            .collect();
        let attitude = Coordinate {
            angle: ap::initial_base_attitude(n),
            velocity: ap::initial_base_rate(n),
            angle_output: ao::base_attitude(n),
            velocity_output: ao::base_rate(n),
            follows: None,
        };
        all.extend(base.then_some(attitude));
        let first = all.len();
        for j in 0..n {
            all.push(Coordinate {
                angle: ap::initial_joint_angle(n) + j,
                velocity: ap::initial_joint_velocity(n) + j,
                angle_output: ao::joint_angle(n) + j,
                velocity_output: ao::joint_velocity(n) + j,
                follows: None,
            });
        }
        for j in (0..n).filter(|j| self.structure.flexible[*j]) {
            all.push(Coordinate {
                angle: ap::initial_motor_angle(n) + j,
                velocity: ap::initial_motor_velocity(n) + j,
                angle_output: ao::motor_angle(n) + j,
                velocity_output: ao::motor_velocity(n) + j,
                follows: Some((first + j, false)),
            });
        }
        all
    }

    /// Names that belong to one array, or the one name itself.
    pub fn elements<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Quantity> {
        self.parameters.iter().filter(move |q| q.name == name || base_name(&q.name) == name)
    }
}
