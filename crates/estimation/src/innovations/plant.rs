//! What the engine requires of a plant: coordinates, readings, parameters, and its equations under generalised forces.

use super::known_effects::KnownEffects;

/// What moves along a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterCoordinateKind {
    /// A motor's rotor, which its input drives.
    Motor,
    /// A body behind a motor.
    Link,
    /// A body that nothing drives.
    Base,
}

/// A coordinate on which generalised forces act.
#[derive(Clone, Debug, PartialEq)]
pub struct ForcedCoordinate {
    /// Its name in reports.
    pub name: &'static str,
    /// What moves along it.
    pub kind: FilterCoordinateKind,
    /// State index of its position, rad.
    pub position: usize,
    /// State index of its rate, rad/s.
    pub velocity: usize,
    /// Parameter that is the level of its dry friction, N.m; `None`: the nominal plant has none there.
    pub dry: Option<usize>,
    /// Torque at which it breaks away, in levels of its dry friction; 1 at least.
    pub breakaway: f64,
    /// The same where that level is 0, N.m; 0: it never rests.
    pub holds: f64,
}

/// A gear of which a plant's states are all on one side.
#[derive(Clone, Debug, PartialEq)]
pub struct GearTrain {
    /// Its ratio as an FMU variable.
    pub name: &'static str,
    /// Turns of the states' side per turn of the other one.
    pub ratio: f64,
    /// Relative standard deviation of the ratio; `None`: it is known.
    pub deviation: Option<f64>,
    /// Coordinate whose readings and inputs are on the other side.
    pub coordinate: usize,
    /// Parameter that is an inertia on the other side.
    pub inertia: usize,
}

/// A channel of which a state, or the force of an elastic element, is the reading.
#[derive(Clone, Debug, PartialEq)]
pub struct StateReading {
    /// Name of the channel.
    pub name: &'static str,
    /// State that it shows.
    pub state: usize,
    /// State per unit of the channel.
    pub factor: f64,
    /// An angle; else a rate.
    pub angle: bool,
    /// Coordinate to which it belongs.
    pub coordinate: usize,
    /// Elastic element whose force it shows instead of a state, N.m; `None`: it shows a state.
    pub element: Option<usize>,
}

/// A parameter with its prior.
#[derive(Clone, Debug, PartialEq)]
pub struct BelievedParameter {
    /// FMU variable.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The nominal value; a parameter at 0 is not there.
    pub value: f64,
    /// Relative standard deviation of the value.
    pub deviation: f64,
    /// Whether that deviation was declared.
    pub declared: bool,
}

/// Means over one step, of which known forces are functions.
#[derive(Clone, Copy, Debug)]
pub struct StepMeans<'a> {
    /// States of the plant, without latents.
    pub state: &'a [f64],
    /// Inputs, in the order of [`ForcedPlant::input_forces`].
    pub input: &'a [f64],
    /// Sign of dry friction of each coordinate.
    pub sign: &'a [f64],
    /// Forces of the hypothesis in hand, by coordinate, N.m.
    pub own: &'a [f64],
}

/// What the first readings of a coordinate say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstState {
    /// Position and rate.
    pub value: [f64; 2],
    /// Their variances.
    pub variance: [f64; 2],
    /// Rate that is reached or exceeded 3 % of the time.
    pub usual_speed: f64,
}

/// An elastic element of a plant: its force is stiffness times deflection plus damping times rate.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticElement {
    /// Share of its force on each coordinate.
    pub weights: Vec<f64>,
    /// Deflection as a sum of states.
    pub deflection: Vec<f64>,
    /// Rate of deflection as a sum of states.
    pub rate: Vec<f64>,
    /// Parameter that is its stiffness, N.m/rad.
    pub stiffness: usize,
    /// Parameter that is its damping, N.m.s/rad.
    pub damping: usize,
}

/// Figures of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointFigures {
    /// Inertia of the motor, kg.m2.
    pub motor_inertia: f64,
    /// Inertia of the load on its own side, kg.m2.
    pub load_inertia: f64,
    /// Stiffness on the motor's side, N.m/rad; 0: it is rigid.
    pub stiffness: f64,
    /// Damping on the motor's side, N.m.s/rad.
    pub damping: f64,
    /// Viscous friction of the motor, N.m.s/rad.
    pub viscous: f64,
    /// Torque of the motor per unit of the input that drives.
    pub torque_constant: f64,
    /// Turns of the motor per turn of the load.
    pub gear_ratio: f64,
}

/// A plant as the engine sees it. Matrices are rows of rows. A held coordinate keeps its position.
pub trait ForcedPlant {
    /// Number of its states.
    fn states(&self) -> usize;
    /// Its coordinates.
    fn coordinates(&self) -> &[ForcedCoordinate];
    /// Readings that it has.
    fn readings(&self) -> &[StateReading];
    /// Its parameters; what is `theta` below has their order, in their units.
    fn parameters(&self) -> &[BelievedParameter];
    /// Inputs by channel name, each with the parameter that scales it, the constant factor, and the coordinate on which it acts.
    fn input_forces(&self) -> &[InputForce];
    /// Whether a channel is a reading or an input.
    fn has_channel(&self, name: &str) -> bool {
        self.readings().iter().any(|r| r.name == name) || self.input_forces().iter().any(|i| i.name == name)
    }
    /// The input that drives, without which nothing is known of a recording, by index.
    fn required_input(&self) -> usize {
        0
    }
    /// Its gear; `None`: it has none.
    fn gear(&self) -> Option<GearTrain> {
        None
    }
    /// Its elastic elements; none of a rigid plant.
    fn elements(&self) -> &[ElasticElement];
    /// What a reading shows as a sum of states.
    fn reading_row(&self, theta: &[f64], reading: &StateReading) -> Vec<f64> {
        let mut row = vec![0.0; self.states()];
        match reading.element.and_then(|e| self.elements().get(e)) {
            Some(e) => {
                let [k, d] = [theta[e.stiffness], theta[e.damping]];
                let sums = e.deflection.iter().zip(&e.rate).map(|(x, v)| k * x + d * v); // (EST-22)
                row.iter_mut().zip(sums).for_each(|(r, s)| *r = s);
            }
            None => row[reading.state] = 1.0,
        }
        row
    }
    /// Effects that the case declares.
    fn known_effects(&self) -> Option<&KnownEffects> {
        None
    }
    /// Values of the model's parameters, by their index there.
    fn model_parameters(&self, _theta: &[f64]) -> Vec<(usize, f64)> {
        Vec::new()
    }
    /// Usual force, N.m: the unit of everything that has no natural size.
    fn usual_force(&self) -> f64;
    /// Deflection under the usual force, rad; 0 if it does not bend.
    fn usual_deflection(&self) -> f64;
    /// Stiffness and damping of an elastic element, N.m/rad and N.m.s/rad.
    fn elastic(&self, theta: &[f64], element: &ElasticElement) -> [f64; 2] {
        [element.stiffness, element.damping].map(|k| theta[k])
    }
    /// Figures of the joint that it is.
    fn figures(&self, theta: &[f64]) -> JointFigures;
    /// Whether an effect cannot act in it at this place.
    fn refuses(&self, _id: &str, _place: &str) -> bool {
        false
    }
    /// Whether `other` rests where `coordinate` does.
    fn held_with(&self, coordinate: usize, other: usize) -> bool;
    /// Share of the white force of the motor that each coordinate has.
    fn white_shares(&self, theta: &[f64], shares: &mut [f64]);
    /// Rates of the states under these forces alone: dry friction and inputs are among `force`.
    fn rates(&self, theta: &[f64], state: &[f64], force: &[f64], rates: &mut [f64]);
    /// Derivatives of the rates with respect to state (`by_state`, states x states) and force (`by_force`, states x coordinates),
    /// coordinates of `stuck` at rest.
    fn tangent(&self, theta: &[f64], stuck: &[bool], by_state: &mut [f64], by_force: &mut [f64]);
    /// Forces on the coordinates that have the effect of a relative change of each parameter (parameters x coordinates): the
    /// derivative of the inverse dynamics at the model's own accelerations. Their sum over inertias, stiffnesses, dampings,
    /// friction and torque constants is zero.
    fn sensitivities(&self, theta: &[f64], at: &StepMeans<'_>, forces: &mut [f64]);
    /// First state and its variance (states x states) from what the readings say of each coordinate.
    fn begin(&self, seen: &[Option<FirstState>], state: &mut [f64], variance: &mut [f64]);
}

/// How an input acts.
#[derive(Clone, Debug, PartialEq)]
pub struct InputForce {
    /// Name of the channel.
    pub name: &'static str,
    /// Parameter that scales it; `None`: none does.
    pub gain: Option<usize>,
    /// Constant factor.
    pub factor: f64,
    /// Coordinate on which it acts.
    pub coordinate: usize,
}

impl InputForce {
    /// Force per unit of the input.
    pub fn per_unit(&self, theta: &[f64]) -> f64 {
        self.factor * self.gain.map_or(1.0, |k| theta[k])
    }
}

/// Takes the coordinates at rest out of a tangent.
pub(super) fn hold(
    coordinates: &[ForcedCoordinate],
    stuck: &[bool],
    by_state: &mut [f64],
    by_force: &mut [f64],
) {
    let forces = coordinates.len();
    let n = by_force.len() / forces;
    for c in coordinates.iter().zip(stuck).filter(|(_, s)| **s).map(|(c, _)| c) {
        for row in [c.position, c.velocity] {
            by_state[n * row..n * (row + 1)].fill(0.0);
            by_force[forces * row..forces * (row + 1)].fill(0.0);
        }
        (0..n).for_each(|i| by_state[n * i + c.velocity] = 0.0);
    }
}

/// First state of a joint and its variance. Returns the usual speed of what was seen last.
pub(super) fn first_state(
    coordinates: &[ForcedCoordinate],
    (rigid, usual_deflection): (bool, f64),
    seen: &[Option<FirstState>],
    state: &mut [f64],
    variance: &mut [f64],
) -> f64 {
    let n = state.len();
    let spread = if rigid { 0.0 } else { 3.0 * usual_deflection };
    let mut usual_speed = 0.0;
    for (c, own) in seen.iter().enumerate() {
        // Without a reading it begins with the other, give or take the usual twist.
        let other = seen.iter().flatten().last().copied().unwrap_or_default();
        let unseen = [spread.powi(2), (0.02 * other.usual_speed).powi(2)];
        let first = own.unwrap_or(FirstState { variance: unseen, ..other });
        let at = [coordinates[c].position, coordinates[c].velocity];
        for j in 0..2 {
            state[at[j]] = first.value[j];
            variance[(n + 1) * at[j]] = first.variance[j];
        }
        usual_speed = other.usual_speed;
    }
    if rigid {
        let (angle, speed) = (variance[0], variance[n + 1]);
        variance[2 * n + 2] += angle;
        (variance[2], variance[2 * n]) = (angle, angle);
        (variance[n + 3], variance[3 * n + 1], variance[3 * n + 3]) = (speed, speed, speed);
        state[3] = state[1];
    }
    usual_speed
}
