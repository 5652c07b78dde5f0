//! `CaptureScene`: SIM2, central impacts, what is conserved. Golden facts C11-C15, C36-C39, C44 and C45, computed by others.

use super::run::{Moments, TIGHT, place, run, set};
use trueup_models::arm::{PlanarManipulator, output, parameter};
use trueup_models::contact::impact::Impact;
use trueup_models::contact::layout::{
    ChaserOutputs, ChaserParameters, ChaserStates, Outputs, Parameters, SceneOutputs, SceneParameters,
    SceneStates, States,
};
use trueup_models::contact::{CaptureOutcome, CaptureScene, Chaser, GripperStructure, RigidChaser};
use trueup_models::layout::{AllowedValues, LayoutEntry, LayoutState, Parameter, Shows};
use trueup_numerics::driver::DriverOptions;
use trueup_numerics::hybrid::Hybrid;

pub(super) fn seconds(to: usize) -> Vec<f64> {
    (1..=to).map(|t| t as f64).collect()
}

/// A capture with its variables and their values.
pub(super) struct Sim<C = RigidChaser> {
    pub scene: CaptureScene<C>,
    pub p: Vec<f64>,
    pub parameters: Vec<LayoutEntry<Parameter>>,
    pub outputs: Vec<LayoutEntry<Shows>>,
    pub nominal: Vec<f64>,
}

fn entry<K>(name: &'static str, dimensions: Vec<usize>, kind: K) -> LayoutEntry<K> {
    LayoutEntry { name, dimensions, unit: "", kind, text: "" }
}

impl Sim {
    pub(super) fn of(structure: GripperStructure) -> Self {
        let (s, none) = (&structure, &());
        let scene = CaptureScene::new(RigidChaser::default(), structure).unwrap();
        let states = [States::list(s), ChaserStates::list(none), SceneStates::list(none)].concat();
        Self {
            p: scene.defaults(),
            scene,
            parameters: [Parameters::list(s), ChaserParameters::list(none), SceneParameters::list(none)]
                .concat(),
            outputs: [Outputs::list(s), ChaserOutputs::list(none), SceneOutputs::list(none)].concat(),
            nominal: states.into_iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect(),
        }
    }
}

impl Sim {
    /// How far linear momentum along x and y, angular momentum (each by what bodies exchange, where it begins at 0) and the balance of
    /// energy, J, come from what they are at the start.
    pub(super) fn drift(&self, all: &Moments) -> [f64; 4] {
        let of = |name: &str| self.output(name);
        let [p, l, t] = ["linearMomentum", "angularMomentum", "kineticEnergy"].map(of);
        let [elastic, lost, work] = ["elasticEnergy", "dissipatedEnergy", "jawWork"].map(of);
        let most = |at: usize, size: f64| all.y.iter().map(|y| (size * y[at]).abs()).fold(0.0, f64::max);
        let exchanged = most(of("chaserVelocity") + 1, self.parameter("chaserMass")[0]);
        let turning = most(of("targetRate"), self.parameter("targetInertia")[0]);
        assert!(exchanged > 1e-2 && turning > 1e-2, "something has to happen");
        let balance = |y: &[f64]| y[t] + y[elastic] + y[lost] - y[work];
        let first = &all.y[0];
        all.y.iter().fold([0.0; 4], |drift: [f64; 4], y| {
            let now = [
                (y[p] - first[p]) / first[p],
                (y[p + 1] - first[p + 1]) / exchanged,
                (y[l] - first[l]) / turning,
                balance(y) - balance(first),
            ];
            core::array::from_fn(|i| drift[i].max(now[i].abs()))
        })
    }
}

impl Sim<PlanarManipulator> {
    /// The hand at the tip of such a manipulator.
    pub(super) fn with_arm(flexible: &[bool], structure: GripperStructure) -> Self {
        let n = flexible.len();
        let own = |names: &'static [(&'static str, fn(usize) -> usize)]| {
            names.iter().map(move |(name, length)| (*name, vec![length(n)]))
        };
        let s = &structure;
        let arm = PlanarManipulator::new::<&str>(flexible, &[]).unwrap();
        let chaser_states = arm.sizes().states;
        let scene = CaptureScene::new(arm, structure).unwrap();
        let any = Parameter::fixed(AllowedValues::Any);
        let parameters = own(parameter::NAMES).map(|(name, dimensions)| entry(name, dimensions, any));
        let outputs = own(output::NAMES).map(|(name, dimensions)| entry(name, dimensions, Shows::States));
        let nominal = |list: Vec<LayoutEntry<LayoutState>>| {
            list.into_iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect::<Vec<_>>()
        };
        Self {
            p: scene.defaults(),
            scene,
            parameters: Parameters::list(s)
                .into_iter()
                .chain(parameters)
                .chain(SceneParameters::list(&()))
                .collect(),
            outputs: Outputs::list(s).into_iter().chain(outputs).chain(SceneOutputs::list(&())).collect(),
            nominal: [nominal(States::list(s)), vec![1e-3; chaser_states], nominal(SceneStates::list(&()))]
                .concat(),
        }
    }
}

impl<C: Chaser> Sim<C> {
    pub(super) fn set(mut self, name: &str, values: &[f64]) -> Self {
        set(&self.parameters, &mut self.p, name, values);
        self
    }
    pub(super) fn parameter(&self, name: &str) -> &[f64] {
        let length = self.parameters.iter().find(|e| e.name == name).map_or(0, LayoutEntry::len);
        &self.p[place(&self.parameters, name)..][..length]
    }
    pub(super) fn run(&self, times: &[f64], options: DriverOptions) -> Moments {
        let u = vec![0.0; self.scene.sizes().inputs];
        self.scene.check(&self.p).unwrap();
        run(&self.scene, &self.p, &u, times, &self.nominal, options)
    }
    pub(super) fn output(&self, name: &str) -> usize {
        place(&self.outputs, name)
    }
}

/// Checks C44, C45 and CON-6: SIM2 with contacts located; peaks, and how wrong the printed (21) is.
#[test]
fn sim2_has_the_peaks_of_the_golden_facts() {
    let sim = Sim::of(GripperStructure::default());
    let all = sim.run(&seconds(30), TIGHT);
    let energy = sim.output("relativeKineticEnergy");
    let peak = all.largest(energy);
    let force = sim.output("contactForce");
    let forces = [0, 1, 2].map(|i| all.largest(force + i));
    let printed = sim.output("relativeKineticEnergyAsPrinted");
    println!(
        "energy {peak} forces {forces:?} end {} printed {} end {}",
        all.end()[energy],
        all.largest(printed),
        all.end()[printed]
    );
    assert!((peak / 68.908944 - 1.0).abs() < 1e-4, "{peak}");
    for (have, want) in forces.iter().zip([6.1355489, 92.9170072, 93.2854767]) {
        assert!((have / want - 1.0).abs() < 1e-4, "{forces:?}");
    }
    // 14.6 of samples; with the onsets it is more.
    assert!((all.largest(printed) - 14.715).abs() < 0.001 && (all.end()[printed] - 3.70).abs() < 0.005);
    assert!((all.end()[energy] - 3.42).abs() < 0.005);
    assert_eq!(all.end()[sim.output("outcome")], f64::from(CaptureOutcome::PushedAway as i32));
}

/// C15, and the balance of energy: over 30 s of SIM2 nothing of momentum or energy is lost.
#[test]
fn momentum_and_energy_of_sim2_are_kept() {
    for (name, law, friction) in
        [("printed", 1.0, 0.0), ("hunt-crossley", 2.0, 0.0), ("printed with friction", 1.0, 0.3)]
    {
        let sim = Sim::of(GripperStructure::default())
            .set("damping", &[law])
            .set("frictionCoefficient", &[friction]);
        let all = sim.run(&seconds(30), TIGHT);
        let drift = sim.drift(&all);
        println!(
            "{name}: drift of momenta {:.1e} {:.1e} {:.1e}, of energy {:.1e} J",
            drift[0], drift[1], drift[2], drift[3]
        );
        assert!(drift[..3].iter().all(|d| *d < 1e-10), "{drift:?}");
        assert!(drift[3] < 1e-9, "{drift:?}");
        let [lost, work] = ["dissipatedEnergy", "jawWork"].map(|name| all.end()[sim.output(name)]);
        assert!(lost > 1e-2 && work.abs() > 1e-2, "something has to happen");
    }
}

/// Balls on the line of both centres of mass, jaws out of the way.
fn central() -> Sim {
    Sim::of(GripperStructure { balls: 1, ..GripperStructure::default() })
        .set("targetCenterOfMass", &[5.0, 0.0])
        .set("initialPortOffset", &[0.1 + 0.005, 0.0])
}

/// Checks C11, C36, C38 and C39, and the times of CON-3 and CON-4: a central impact by located events.
#[test]
fn a_central_impact_is_the_closed_form() {
    let impact = Impact {
        mass: 1778.7 * 7900.0 / (1778.7 + 7900.0),
        stiffness: 20000.0,
        damping: 900.0,
        speed: 0.005,
    };
    let sim = central();
    let all = sim.run(&[3.0], DriverOptions { max_step: 1e-3, ..TIGHT });
    let changes = all.changes(0);
    let begin = 0.005 / 0.005;
    let turn = begin + impact.compression();
    let end = turn + impact.restitution_time();
    assert_eq!(changes.iter().map(|c| c.1).collect::<Vec<_>>(), [1, 2, 3]);
    let worst =
        changes.iter().zip([begin, turn, end]).map(|(c, want)| (c.0 - want).abs()).fold(0.0, f64::max);
    println!("times of contact: within {worst:.1e} s of the closed form");
    assert!(worst < 1e-9);
    let y = all.end();
    let parting = y[sim.output("targetVelocity")] - y[sim.output("chaserVelocity")];
    assert!((parting / 0.005 - impact.restitution()).abs() < 1e-9, "{parting}");
    assert!((y[sim.output("dissipatedEnergy")] - impact.loss()).abs() < 1e-12);
    let deepest = all.largest(sim.output("penetration"));
    assert!((deepest - impact.deepest()).abs() < 1e-9, "{deepest}");
    let force = all.largest(sim.output("contactForce"));
    assert!((force - impact.largest_force()).abs() < 1e-5, "{force}: between the steps it may be larger");
    let onset = (0..all.t.len()).find(|i| all.event[*i] && all.t[*i] >= changes[0].0).unwrap();
    assert!((all.y[onset][sim.output("contactForce")] - 4.5).abs() < 1e-9, "C12");
    assert!((all.y[0][sim.output("relativeKineticEnergy")] - 0.09875).abs() < 1e-12, "C13");
}

/// Checks CON-5: an impact off the target's centre of mass, bodies that turn (C40, within a thousandth).
#[test]
fn an_oblique_impact_loses_what_its_effective_mass_says() {
    let sim = Sim::of(GripperStructure { balls: 1, ..GripperStructure::default() })
        .set("targetCenterOfMass", &[5.0, -1.3])
        .set("initialPortOffset", &[0.1 + 0.005, 0.0]);
    let all = sim.run(&[3.0], DriverOptions { max_step: 1e-3, ..TIGHT });
    let approach = sim.output("approachSpeed");
    let at = |mode: i32| {
        let i = (1..all.t.len())
            .find(|i| all.event[*i] && all.modes[*i][0] == mode && all.modes[*i - 1][0] != mode);
        all.y[i.unwrap()][approach]
    };
    let e = -at(3) / at(1);
    println!("oblique: e {e}");
    assert!((e - 0.8818342227274125).abs() < 1e-3);
    let mu = 1424.7449232210847;
    let lost = all.end()[sim.output("dissipatedEnergy")];
    assert!((lost / (0.5 * mu * 0.005 * 0.005 * (1.0 - e * e)) - 1.0).abs() < 5e-3, "{lost}");
}

/// Checks CON-3: a contact of a fifth of a second, soft enough that the balls pass through each other, is found by a solver whose
/// steps are longer than it.
#[test]
fn no_step_is_so_long_that_a_contact_is_missed() {
    let sim = central()
        .set("stiffness", &[1e-9])
        .set("normalDamping", &[0.0])
        .set("initialPortOffset", &[50.0, 0.03])
        .set("initialChaserVelocity", &[1.0, 0.0]);
    let all = sim.run(&[60.0], DriverOptions { tolerance: 1e-3, ..TIGHT });
    let changes = all.changes(0);
    let reach = (0.1f64 * 0.1 - 0.03 * 0.03).sqrt();
    let wanted = [(50.0 - reach, 1), (50.0, 2), (50.0 + reach, 3)];
    assert_eq!(changes.len(), 3, "{changes:?}");
    for (change, want) in changes.iter().zip(wanted) {
        assert!((change.0 - want.0).abs() < 1e-9 && change.1 == want.1, "{changes:?}");
    }
    let before = all.t.partition_point(|t| *t < wanted[0].0 - 1e-6);
    assert!(all.t[before] - all.t[before - 1] > 1.0, "{:?}", &all.t[..=before]);
}
