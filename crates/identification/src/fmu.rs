//! An FMU for Model Exchange as what is fitted: ours or a third party's, FMI 2.0 or 3.0, so that what is fitted is what is
//! shipped.
//!
//! Parameters are its `Float64` parameters and the start values of its states (`initial = "exact"`), by name; arrays
//! element by element. A recording is simulated as a model of ours is: the same inputs between samples, the same instants
//! of readings ([`PredictionPlan`]), stick-slip and other events located.
//!
//! **Derivatives by parameters** are central differences over whole simulations: the standard has directional derivatives
//! with respect to states and continuous inputs, not to fixed parameters, and none across events. Where the FMU offers
//! them, the stiff integrator takes its Jacobian from them.

mod error;
mod inserted;
mod lane;
mod simulate;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};

use crate::parallel;
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, Initial, StartValues,
    VariableType,
};
use trueup_fmi_import::{AnyInstance, MAX_ELEMENTS, UnpackedFmu, element_quantities};
use trueup_numerics::hybrid::ModelSizes;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::QuantityRole;
use trueup_signals::{ParameterValue, VariableRole, base_name};

pub use error::FmuError;
pub use inserted::{InsertedForces, InsertedLaw};

use crate::model::{CoordinateIndices, ModelError, NamedVariables, PlantQuantity};
use crate::predict::{InputMap, PredictError, PredictionPlan};
use crate::predictor::Predictor;
use crate::subject::IdentificationSubject;
use trueup_plant::{LANES, Lanes};

/// A variable that is set or read, with the places of its elements among all of its kind.
#[derive(Clone, Debug)]
struct VariablePlace {
    reference: u32,
    elements: Range<usize>,
}

/// A parameter that is no real number: chosen by the case, not fitted.
#[derive(Clone, Debug)]
struct StructuralChoice {
    reference: u32,
    kind: VariableType,
    start: Option<f64>,
    /// It can be set.
    settable: bool,
}

/// An FMU with its variables by name.
pub struct FmuSubject {
    fmu: Arc<UnpackedFmu>,
    name: String,
    parameters: Vec<PlantQuantity>,
    inputs: Vec<PlantQuantity>,
    outputs: Vec<PlantQuantity>,
    parameter_places: Vec<VariablePlace>,
    input_places: Vec<VariablePlace>,
    output_places: Vec<VariablePlace>,
    choices: HashMap<String, StructuralChoice>,
    /// What the case chose: reference, type, value.
    chosen: Vec<(u32, VariableType, f64)>,
    /// (parameter, output): a state whose start value can be set.
    states: Vec<(usize, usize)>,
    /// Parameters that only say how a run begins.
    initial: Vec<usize>,
    /// Whether derivatives along the way are to be had and agree with differences.
    along: AtomicU8,
    /// Relative tolerance of the integrator.
    tolerance: f64,
    /// Coordinates that are known otherwise than by their names.
    known: Option<Vec<CoordinateIndices>>,
    /// What acts through its inputs in addition to what was recorded.
    inserted: Option<InsertedForces>,
    idle: Mutex<Vec<AnyInstance>>,
}

impl std::fmt::Debug for FmuSubject {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FmuSubject").field("file", &self.fmu.file()).finish_non_exhaustive()
    }
}

/// Relative tolerance of the local error. Differences over whole simulations see what it leaves.
const TOLERANCE: f64 = 1e-10;
/// What is known of derivatives along the way.
const UNKNOWN: u8 = 0;
const TRUSTED: u8 = 1;
const REFUSED: u8 = 2;
/// Half the width of a central difference: of a logarithm, and of a linear unknown in its magnitude.
const WIDTH: [f64; 2] = [1e-4, 1e-2];

/// What a variable is by the name that FMUs of this project give it: a description has no roles.
fn role(name: &str) -> QuantityRole {
    if name.starts_with("initial") {
        QuantityRole::Initial
    } else if base_name(name).ends_with("Angle") {
        QuantityRole::JointAngle
    } else {
        QuantityRole::Plain
    }
}

impl FmuSubject {
    /// Opens an FMU. It is native code of somebody else: opening it means trusting it.
    ///
    /// # Errors
    /// See [`FmuError`].
    pub fn open(file: impl AsRef<Path>) -> Result<Self, FmuError> {
        let fmu = UnpackedFmu::open(file).map_err(Box::new)?;
        let d = fmu.description();
        if d.model_exchange.is_none() {
            let offers: Vec<&str> = d.interfaces().map(|(name, _)| name).collect();
            return Err(FmuError::NoModelExchange {
                file: fmu.file().display().to_string(),
                offers: offers.join(" and "),
            });
        }
        let mut left = MAX_ELEMENTS;
        for v in d.variables.iter().filter(|v| v.kind == VariableType::Float64) {
            let elements = d.elements(v).unwrap_or(0);
            left = left.checked_sub(elements).ok_or_else(|| FmuError::TooLarge {
                file: fmu.file().display().to_string(),
                variable: v.name.clone(),
                elements,
            })?;
        }
        let mut m = Self {
            fmu: Arc::clone(&fmu),
            name: d.model_name.clone(),
            parameters: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            parameter_places: Vec::new(),
            input_places: Vec::new(),
            output_places: Vec::new(),
            choices: HashMap::new(),
            chosen: Vec::new(),
            states: Vec::new(),
            initial: Vec::new(),
            along: AtomicU8::new(UNKNOWN),
            tolerance: TOLERANCE,
            known: None,
            inserted: None,
            idle: Mutex::default(),
        };
        let of_states: Vec<usize> = (d.structure.derivatives.iter())
            .filter_map(|u| d.resolve(d.variables.get(d.resolve(u.reference)?)?.derivative?))
            .collect();
        for (at, v) in d.variables.iter().enumerate() {
            m.add(d, v, of_states.contains(&at));
        }
        m.initial = (m.coordinates().iter().flat_map(|c| [c.angle, c.velocity]))
            .chain(m.states.iter().map(|s| s.0))
            .collect();
        Ok(m)
    }

    fn add(&mut self, d: &Description, v: &DescriptionVariable, state: bool) {
        let parameter = v.causality == DescriptionCausality::Parameter;
        let constant = v.variability == DescriptionVariability::Constant;
        if v.kind != VariableType::Float64 || constant {
            let start = v.start.as_ref().and_then(StartValues::as_f64).and_then(|s| s.first().copied());
            let kept = parameter || constant || v.causality == DescriptionCausality::StructuralParameter;
            if kept && v.dimensions.is_empty() && start.is_some() {
                let settable = parameter && v.kind != VariableType::Float64;
                let choice = StructuralChoice { reference: v.value_reference, kind: v.kind, start, settable };
                self.choices.insert(v.name.clone(), choice);
            }
            return;
        }
        let Some(elements) = element_quantities(d, v) else { return };
        let with_role = |q: PlantQuantity| PlantQuantity { role: role(&q.name), ..q };
        let elements: Vec<PlantQuantity> = elements.into_iter().map(with_role).collect();
        let put = |list: &mut Vec<PlantQuantity>, places: &mut Vec<VariablePlace>| {
            places.push(VariablePlace {
                reference: v.value_reference,
                elements: list.len()..list.len() + elements.len(),
            });
            list.extend_from_slice(&elements);
        };
        let exact = v.effective_initial() == Some(Initial::Exact);
        let shown = matches!(v.causality, DescriptionCausality::Output | DescriptionCausality::Local);
        if parameter || shown && exact && state {
            let begin = self.parameters.len();
            put(&mut self.parameters, &mut self.parameter_places);
            if !parameter {
                self.states.extend((0..elements.len()).map(|k| (begin + k, self.outputs.len() + k)));
            }
        }
        match v.causality {
            DescriptionCausality::Input => put(&mut self.inputs, &mut self.input_places),
            DescriptionCausality::Output | DescriptionCausality::Local => {
                put(&mut self.outputs, &mut self.output_places)
            }
            _ => {}
        }
    }

    /// The FMU's `modelName`.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// The FMU.
    pub fn fmu(&self) -> &Arc<UnpackedFmu> {
        &self.fmu
    }
    /// Start values of its parameters, as its description has them.
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|q| q.start).collect()
    }
    /// All that recordings and cases may name.
    pub fn variables(&self) -> Vec<trueup_signals::SignalVariable> {
        let list = |all: &[PlantQuantity], role: VariableRole| -> Vec<_> {
            let made = all.iter().map(|q| trueup_signals::SignalVariable {
                min: q.min.is_finite().then_some(q.min),
                max: q.max.is_finite().then_some(q.max),
                ..trueup_signals::SignalVariable::new(&q.name, q.unit, role)
            });
            made.collect()
        };
        // A state is an output first: its column in a recording is what it showed.
        let mut all = list(&self.inputs, VariableRole::Input);
        all.extend(list(&self.outputs, VariableRole::Output));
        all.extend(list(&self.parameters, VariableRole::Parameter));
        let mut choices: Vec<_> = self.choices.keys().collect();
        choices.sort();
        all.extend(choices.into_iter().map(|n| trueup_signals::SignalVariable {
            takes: trueup_signals::Takes::Anything,
            ..trueup_signals::SignalVariable::new(n, "", VariableRole::Parameter)
        }));
        all
    }

    /// All parameters by name from another list (a case's, a recording's), the rest from `base`.
    ///
    /// # Errors
    /// A value that is no number, or none that the parameter can have; a choice that was fixed when the FMU was made.
    pub fn set<'a>(
        &self,
        base: &[f64],
        given: impl IntoIterator<Item = (&'a String, &'a ParameterValue)>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut p = base.to_vec();
        for (name, value) in given {
            let Some(i) = self.parameter(name) else { continue };
            let wrong = |what: String| ModelError::Parameter { name: name.clone(), what };
            p[i] = (value.number().filter(|v| v.is_finite()))
                .ok_or_else(|| wrong(format!("{value} is no number")))?;
            let q = &self.parameters[i];
            if p[i] < q.min || p[i] > q.max {
                return Err(wrong(format!("{} is outside {} .. {}", p[i], q.min, q.max)));
            }
        }
        Ok(p)
    }

    /// Takes the case's choices: truth values, integers, items by number.
    ///
    /// # Errors
    /// One that was fixed when the FMU was made, and is another there.
    pub fn choose<'a>(
        &mut self,
        given: impl IntoIterator<Item = (&'a String, &'a ParameterValue)>,
    ) -> Result<(), ModelError> {
        for (name, value) in given {
            let wrong = |what: String| ModelError::Parameter { name: name.clone(), what };
            let Some(choice) = self.choices.get(name) else {
                if self.parameter(name).is_some() {
                    continue;
                }
                return Err(wrong(format!(
                    "the FMU has no parameter of that name; see `trueup fmu info {}`",
                    self.fmu.file().display()
                )));
            };
            let number = value.boolean().map(f64::from).or_else(|| value.number());
            let number = number.ok_or_else(|| wrong(format!("{value} is no number and no truth value")))?;
            if !choice.settable && choice.start != Some(number) {
                return Err(wrong(format!(
                    "{value} in the case, {} in the FMU, where it was fixed when it was made: make the FMU with it",
                    choice.start.unwrap_or_default()
                )));
            }
            if choice.settable && choice.start != Some(number) {
                self.chosen.push((choice.reference, choice.kind, number));
            }
        }
        Ok(())
    }

    /// What is estimated unless the case chooses otherwise: of a joint of ours what belongs to it, else nothing.
    pub fn usual(&self) -> Vec<String> {
        let usual = ["stiffness", "damping", "coulombFriction", "viscousFriction", "staticFriction"];
        let known: Vec<String> =
            usual.iter().filter(|n| self.parameter(n).is_some()).map(|n| (*n).to_owned()).collect();
        if self.parameter("motorInertia").is_some() && known.len() == usual.len() {
            known
        } else {
            Vec::new()
        }
    }

    /// Coordinates by the names that FMUs of this project give them: `motorAngle` begins at `initialMotorAngle`.
    pub fn coordinates(&self) -> Vec<CoordinateIndices> {
        if let Some(known) = &self.known {
            return known.clone();
        }
        let rate_of = |angle: &str| {
            [("Angle", "Velocity"), ("Position", "Velocity"), ("Attitude", "Rate")]
                .iter()
                .find(|(a, _)| angle.contains(a))
                .map(|(a, v)| angle.replace(a, v))
        };
        let initial = |name: &str| {
            let mut letters = name.chars();
            let first = letters.next().map(|c| c.to_ascii_uppercase());
            first.map(|c| format!("initial{c}{}", letters.as_str()))
        };
        let mut all: Vec<CoordinateIndices> = Vec::new();
        for (angle_output, q) in self.outputs.iter().enumerate() {
            let found = (|| {
                let rate = rate_of(&q.name)?;
                Some(CoordinateIndices {
                    angle: self.parameter(&initial(&q.name)?)?,
                    velocity: self.parameter(&initial(&rate)?)?,
                    angle_output,
                    velocity_output: self.output(&rate)?,
                    follows: None,
                })
            })();
            all.extend(found);
        }
        let place = |name: &str| all.iter().position(|c| self.outputs[c.angle_output].name == name);
        let geared = place("motorAngle").zip(place("loadAngle")).filter(|(m, l)| m < l);
        if let (Some((motor, load)), Some(_)) = (geared, self.parameter("gearRatio")) {
            all[load].follows = Some((motor, true));
        }
        for k in 0..all.len() {
            let own = self.outputs[all[k].angle_output].name.replace("motorAngle[", "jointAngle[");
            let joint = all.iter().position(|c| self.outputs[c.angle_output].name == own);
            all[k].follows = all[k].follows.or(joint.filter(|j| *j < k).map(|j| (j, false)));
        }
        all
    }

    fn width(p: &[Dual<1>]) -> f64 {
        let logarithm = p.iter().any(|v| v.eps[0] != 0.0 && v.eps[0] == v.re);
        WIDTH[usize::from(!logarithm)]
    }
}

impl NamedVariables for FmuSubject {
    fn parameters(&self) -> &[PlantQuantity] {
        &self.parameters
    }
    fn inputs(&self) -> &[PlantQuantity] {
        &self.inputs
    }
    fn outputs(&self) -> &[PlantQuantity] {
        &self.outputs
    }
    fn is_velocity(&self, list: &[PlantQuantity], at: usize) -> bool {
        list[at].name.contains("Velocity") || list[at].name.contains("Rate")
    }
    /// Real numbers all: a third party may leave out units.
    fn compares(&self, _output: usize) -> bool {
        true
    }
}

impl IdentificationSubject for FmuSubject {
    fn begins(&self) -> Vec<CoordinateIndices> {
        self.coordinates()
    }
    fn shown_states(&self) -> &[(usize, usize)] {
        &self.states
    }
    fn with_values(
        &self,
        base: &[f64],
        given: &BTreeMap<String, ParameterValue>,
    ) -> Result<Vec<f64>, ModelError> {
        self.set(base, given)
    }
    fn fits(&self) -> Vec<String> {
        self.usual()
    }
}

impl Predictor for FmuSubject {
    fn counts(&self) -> ModelSizes {
        ModelSizes {
            inputs: self.inputs.len(),
            parameters: self.parameters.len(),
            outputs: self.outputs.len(),
            ..ModelSizes::default()
        }
    }

    fn readings(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        _at_rest: bool,
    ) -> Result<Vec<f64>, PredictError> {
        self.simulate(plan, p, map)
    }

    /// Along the way where the FMU gives directional derivatives by these parameters; else by differences.
    fn readings_along(
        &self,
        plan: &PredictionPlan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        at_rest: bool,
    ) -> Result<Vec<Lanes>, PredictError> {
        let moves = |k: usize| p.iter().chain(&map.gain).chain(&map.bias).any(|v| v.eps[k] != 0.0);
        let acting: Vec<usize> = (0..LANES).filter(|&k| moves(k)).collect();
        // What is inserted has derivatives that the FMU does not know.
        let known = if self.inserted.is_some() { REFUSED } else { self.along.load(Ordering::Relaxed) };
        let along = (known != REFUSED).then(|| self.sensitivities(plan, p, map, &acting)).flatten();
        if let (Some(y), TRUSTED) = (&along, known) {
            return Ok(y.clone());
        }
        let y = self.differences(plan, p, map, at_rest, &acting)?;
        if known == UNKNOWN {
            let trusted = along.as_ref().is_some_and(|a| agree(a, &y, &acting));
            self.along.store(if trusted { TRUSTED } else { REFUSED }, Ordering::Relaxed);
        }
        Ok(y)
    }
}

/// Derivatives along the way and differences, of which a few may have met another event.
fn agree(along: &[Lanes], differences: &[Lanes], acting: &[usize]) -> bool {
    acting.iter().all(|&k| {
        let size =
            (differences.iter().map(|y| y.eps[k].powi(2)).sum::<f64>() / differences.len() as f64).sqrt();
        let off = along.iter().zip(differences).filter(|(a, b)| (a.eps[k] - b.eps[k]).abs() > 0.03 * size);
        off.count() * 5 <= along.len()
    })
}

impl FmuSubject {
    /// By central differences, lane by lane.
    fn differences(
        &self,
        plan: &PredictionPlan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        at_rest: bool,
        acting: &[usize],
    ) -> Result<Vec<Lanes>, PredictError> {
        let lane = |v: &[Lanes], k: usize| -> Vec<Dual<1>> {
            v.iter().map(|v| Dual::new(v.re, [v.eps[k]])).collect()
        };
        let moved = |v: &[Dual<1>], by: f64| -> Vec<f64> { v.iter().map(|v| v.re + by * v.eps[0]).collect() };
        let all: Vec<Vec<Dual<1>>> =
            (0..LANES).map(|k| [lane(p, k), lane(&map.gain, k), lane(&map.bias, k)].concat()).collect();
        let run = |k: usize, by: f64| {
            let v = moved(&all[k], by);
            let (p, inputs) = v.split_at(p.len());
            let (gain, bias) = inputs.split_at(map.gain.len());
            self.readings(plan, p, &InputMap { gain: gain.to_vec(), bias: bias.to_vec() }, at_rest)
        };
        let mut jobs: Vec<(usize, f64)> = vec![(0, 0.0)];
        for &k in acting {
            let width = Self::width(&all[k]);
            jobs.extend([(k, -width), (k, width)]);
        }
        let found: Result<Vec<Vec<f64>>, PredictError> =
            parallel::map(&jobs, |(k, by)| run(*k, *by)).into_iter().collect();
        let found = found?;
        let mut y: Vec<Lanes> = found[0].iter().map(|v| Dual::constant(*v)).collect();
        for (job, &k) in acting.iter().enumerate() {
            let (low, high, width) = (&found[2 * job + 1], &found[2 * job + 2], jobs[2 * job + 2].1);
            for (i, y) in y.iter_mut().enumerate() {
                y.eps[k] = (high[i] - low[i]) / (2.0 * width);
            }
        }
        Ok(y)
    }
}
