//! Effects that change the structure of the plant, each in a frame of its own: a tip on the load, first friction, first spring.

use std::f64::consts::PI;
use std::rc::Rc;

use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::two_mass::{LoadTip, TwoMassPlant, parameter};

use super::candidate::ScreenedShape;
use super::hypothesis::{FittedEffect, of_structure};
use super::joint_along::{UsualSizes, along_joint};
use super::laws::law_of;
use super::screen::{Screening, bank};
use super::shape::LawShape;

/// Factors of a tip's frequency that are tried, one after the other; squared for its share, cubed for its damping.
const FACTORS: [f64; 5] = [1.4, 1.2, 1.1, 1.05, 1.02];
/// Frequencies with which a spring begins, Hz.
const SPRINGS: [f64; 5] = [3.0, 6.0, 12.0, 20.0, 35.0];
/// Nats that the priors of a tip, of friction, and of a spring cost, about.
const PRIOR: [f64; 3] = [6.0, 2.0, 4.0];

/// Tips that were tried, of which the best is kept.
struct TipSearch<'a> {
    of: &'a InnovationsFrame,
    plant: &'a TwoMassPlant,
    q: &'a [f64],
    tried: Vec<[i64; 3]>,
    best: Option<(LoadTip, InnovationsFrame)>,
}

impl TipSearch<'_> {
    fn evidence(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |b| b.1.evidence)
    }
    fn look(&mut self, tip: LoadTip) {
        let tip =
            LoadTip { share: tip.share.clamp(0.003, 0.9), damping: tip.damping.clamp(0.002, 0.5), ..tip };
        let key = [tip.share, tip.frequency, tip.damping].map(|x| (x.ln() * 1e4).round_ties_even() as i64);
        if self.tried.contains(&key) {
            return;
        }
        self.tried.push(key);
        let f = self.of;
        let mut z = InnovationsFrame::new(&f.intake, Rc::new(self.plant.with_tip(tip)), None);
        z.start.clone_from(&f.start);
        z.theta.clone_from(&f.start);
        (z.rest, z.creep, z.white, z.scale) = (f.rest, f.creep, f.white, f.scale);
        z.q = self.best.as_ref().map_or_else(|| self.q.to_vec(), |b| b.1.q.clone());
        z.signs_along(f);
        z.smooth(&z.q.clone(), None);
        (z.q, z.evidence) = z.null(&z.q.clone(), 1, false);
        if z.evidence > self.evidence() {
            self.best = Some((tip, z));
        }
    }
}

/// The load with a tip on a spring: share, frequency and damping by pattern search from the screen's resonance.
pub fn with_tip(
    f: &InnovationsFrame,
    plant: &TwoMassPlant,
    screened: &ScreenedShape,
) -> Option<FittedEffect> {
    let amplitude = screened.amplitudes.first().copied().unwrap_or(0.0).clamp(0.005, 4.0);
    let share = amplitude / (1.0 + amplitude);
    let mut search = TipSearch { of: f, plant, q: &screened.intensities, tried: Vec::new(), best: None };
    for k in [1.0, 0.3] {
        let frequency = screened.shape.value("f") * (1.0 - share * k).sqrt();
        search.look(LoadTip { share: share * k, frequency, damping: screened.shape.value("z").min(0.03) });
    }
    for factor in FACTORS {
        for number in [1, 0, 2] {
            let from = search.best.as_ref().map(|b| b.0)?;
            let step = [factor.powi(2), factor, factor.powi(3)][number];
            for by in [1.0 / step, step] {
                let mut tip = from;
                *[&mut tip.share, &mut tip.frequency, &mut tip.damping][number] *= by;
                let before = search.evidence();
                search.look(tip);
                if search.evidence() > before + 0.1 {
                    break;
                }
            }
        }
    }
    let (tip, mut z) = search.best?;
    z.smooth(&z.q.clone(), None);
    z.signs_from_states();
    z.smooth(&z.q.clone(), None);
    let fit = z.fit(&|_| Vec::new(), &z.q.clone(), 4, false);
    z.start.clone_from(&fit.theta);
    let values = [("m", tip.share), ("f", tip.frequency), ("z", tip.damping)];
    let evidence = fit.evidence.max(z.evidence) - PRIOR[0];
    Some(of_structure(z, "flexible-link", LawShape::new("load", "states", &values), fit, evidence))
}

/// A motor with dry friction where the nominal model has none: its level is among the unknowns.
pub fn with_friction(
    f: &mut InnovationsFrame,
    plant: &TwoMassPlant,
    sizes: &UsualSizes,
) -> Vec<FittedEffect> {
    f.reset(&f.q.clone());
    let shape = LawShape::new("motor-friction", "level", &[]);
    let law = law_of("motor-friction");
    let made = law.and_then(|l| ScreenedShape::new(l, &along_joint(f, sizes), shape.clone()));
    let mut all: Vec<ScreenedShape> = made.into_iter().collect();
    let q = f.q.clone();
    Screening::of_joint(f, &[]).look(f, &mut all, &bank(&q, &[1.0, 0.1]));
    let Some(found) = all.into_iter().find(ScreenedShape::is_possible) else { return Vec::new() };
    let mut out = Vec::new();
    for k in [1.0, 0.5] {
        let unit = f.plant.usual_force();
        let (mut values, mut deviations) = beliefs(f);
        values[parameter::COULOMB_FRICTION] = (k * found.amplitudes[0]).max(0.005) * unit;
        values[parameter::VISCOUS_FRICTION] = found.amplitudes[1].max(0.005) * unit / sizes.motor_speed
            + f.plant.parameters()[parameter::VISCOUS_FRICTION].value;
        deviations[parameter::COULOMB_FRICTION] = 1.0;
        deviations[parameter::VISCOUS_FRICTION] = 1.0;
        let plant = plant.believed(&values, &deviations);
        let mut z = InnovationsFrame::new(&f.intake, Rc::new(plant), None);
        z.settle(false);
        let fit = z.fit(&|_| Vec::new(), &z.q.clone(), 5, true);
        z.start.clone_from(&fit.theta);
        let evidence = fit.evidence - PRIOR[1];
        out.push(of_structure(z, "motor-friction", shape.clone(), fit, evidence));
    }
    out
}

/// A joint that is not rigid: stiffness and damping are among the unknowns, from several frequencies.
pub fn with_spring(f: &InnovationsFrame, plant: &TwoMassPlant) -> Option<FittedEffect> {
    let nominal = |k: usize| f.plant.parameters()[k].value;
    let load = nominal(parameter::LOAD_INERTIA) / plant.gear_ratio.powi(2);
    let motor = nominal(parameter::MOTOR_INERTIA);
    let inertia = motor * load / (motor + load);
    let mut best: Option<InnovationsFrame> = None;
    for hz in SPRINGS {
        let stiffness = inertia * (2.0 * PI * hz).powi(2);
        let (mut values, mut deviations) = beliefs(f);
        values[parameter::STIFFNESS] = stiffness;
        values[parameter::DAMPING] = 0.1 * (stiffness * inertia).sqrt();
        deviations[parameter::STIFFNESS] = 1.0;
        deviations[parameter::DAMPING] = 1.0;
        let plant = plant.believed(&values, &deviations);
        let mut z = InnovationsFrame::new(&f.intake, Rc::new(plant), None);
        (z.rest, z.creep, z.white, z.scale) = (f.rest, f.creep, f.white, f.scale);
        z.settle(true);
        if best.as_ref().is_none_or(|b| z.evidence > b.evidence) {
            best = Some(z);
        }
    }
    let mut z = best?;
    z.settle(false);
    let fit = z.fit(&|_| Vec::new(), &z.q.clone(), 6, true);
    z.start.clone_from(&fit.theta);
    let evidence = fit.evidence - PRIOR[2];
    let shape = LawShape::new("transmission", "spring", &[]);
    Some(of_structure(z, "joint-flexibility", shape, fit, evidence))
}

/// Values with which hypotheses begin, and the prior standard deviations.
fn beliefs(f: &InnovationsFrame) -> (Vec<f64>, Vec<f64>) {
    (f.start.clone(), f.plant.parameters().iter().map(|p| p.deviation).collect())
}
