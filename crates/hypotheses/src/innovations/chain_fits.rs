//! Hypotheses about a chain, each from a shape of the screen to the end of its fit.

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::{TrajectoryError, TrajectoryPlant};
use trueup_estimation::innovations::trajectory::structures::PlantStructures;
use trueup_signals::Loaded;

use super::along::PlantAlong;
use super::candidate::ScreenedShape;
use super::chain_along::{ChainSizes, FrameMechanics, along_chain};
use super::chain_effect::ChainEffect;
use super::chain_form::{EffectForm, FormPart};
use super::chain_orders::chain_orders;
use super::chain_screen::{chain_bank, chain_screening, chain_shapes, with_laws};
use super::law::Refinement;
use super::laws::LawRef;
use super::levels::CHAIN_SEARCH;
use super::pairs::held;
use super::screen::Screening;
use super::shape::LawShape;
use super::slope::as_matrices;

/// Rounds of a first fit, of one about the hypothesis' own trajectory.
const ROUNDS: [usize; 2] = [5, 3];
/// Rounds of a pattern search, and for how many more what is steep is searched.
const SEARCH: (usize, usize, [&str; 4]) = (2, 2, ["d", "delay", "gap", "limit"]);
/// Neighbours in steps: relative, and of an order in orders.
const AROUND: [[f64; 4]; 2] = [[-1.0, -0.5, 0.5, 1.0], [-0.6, -0.3, 0.3, 0.6]];

/// A case with what its hypotheses share.
pub struct ChainFits<'a> {
    /// The case.
    pub loaded: &'a Loaded,
    /// Its plant.
    pub structures: &'a PlantStructures,
    /// Usual sizes along the trajectory that the search begins with.
    pub sizes: ChainSizes,
}

impl ChainFits<'_> {
    /// A look along the present trajectory of a frame.
    pub fn along<R>(&self, frame: &TrajectoryFrame, look: impl FnOnce(&PlantAlong<'_>) -> R) -> R {
        let hinged = |theta: &[f64], link: usize, at: f64| self.structures.with_hinge(theta, link, at);
        let mechanics = FrameMechanics::new(frame, &hinged);
        let own;
        let sizes = if self.sizes.speed.len() == frame.coordinates() {
            &self.sizes
        } else {
            own = ChainSizes::of(frame);
            &own
        };
        look(&along_chain(frame, sizes, &mechanics))
    }

    /// Laws of hypotheses along the present trajectory of a frame.
    pub fn applied(&self, frame: &TrajectoryFrame, forms: &[EffectForm]) -> Vec<AppliedLaw> {
        if forms.is_empty() {
            return Vec::new();
        }
        self.along(frame, |along| forms.iter().filter_map(|f| f.applied(along)).collect())
    }

    /// Fits hypotheses together from where a frame is.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn fit(
        &self,
        frame: &mut TrajectoryFrame,
        forms: &[EffectForm],
        q: &[f64],
        rounds: usize,
    ) -> Result<TrajectoryFit, TrajectoryError> {
        let make = |f: &TrajectoryFrame| self.applied(f, forms);
        let tangents = |f: &TrajectoryFrame, laws: &[AppliedLaw], amplitudes: &[f64]| {
            let nodes: Vec<usize> = f.runs.iter().map(|r| r.nodes.len()).collect();
            let mut from = 0;
            self.along(f, |along| {
                let mut all = Vec::new();
                for (form, law) in forms.iter().zip(laws) {
                    let to = from + law.columns.len();
                    all.extend(form.slopes(along, &amplitudes[from..to]));
                    from = to;
                }
                as_matrices(&all, f.coordinates(), &nodes)
            })
        };
        frame.fit(&make, if forms.is_empty() { None } else { Some(&tangents) }, q, rounds, false)
    }

    /// Fits a hypothesis, and again without the companions that came out negative.
    pub(super) fn fit_trimmed(
        &self,
        frame: &mut TrajectoryFrame,
        first: &[EffectForm],
        form: EffectForm,
        q: &[f64],
        rounds: usize,
    ) -> Result<(EffectForm, TrajectoryFit), TrajectoryError> {
        let of_first: usize = self.applied(frame, first).iter().map(|l| l.columns.len()).sum();
        let all = |form: &EffectForm| first.iter().chain([form]).cloned().collect::<Vec<_>>();
        let fit = self.fit(frame, &all(&form), q, rounds)?;
        let Some(less) = form.trimmed(&fit.amplitudes[of_first.min(fit.amplitudes.len())..]) else {
            return Ok((form, fit));
        };
        let fit = self.fit(frame, &all(&less), &fit.intensities.clone(), rounds)?;
        Ok((less, fit))
    }

    /// The shape by pattern search at intensities, all neighbours in one pass, in addition to the laws that are fitted.
    pub fn refined(
        &self,
        frame: &mut TrajectoryFrame,
        mut form: EffectForm,
        q: &[f64],
        standing: &[AppliedLaw],
    ) -> EffectForm {
        if form.is_pushes() {
            return form;
        }
        let mut screening = chain_screening(frame, standing);
        let frame = &*frame;
        self.along(frame, |along| {
            for part in 0..form.parts.len() {
                for r in form.law.refined(&form.parts[part].shape) {
                    form = refined_by(along, frame, form, part, r, q, &mut screening);
                }
            }
            form
        })
    }

    /// Refines a shape along a trajectory and fits it from there.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn attempt(
        &self,
        from: &TrajectoryFrame,
        form: EffectForm,
        q: &[f64],
    ) -> Result<ChainEffect, TrajectoryError> {
        let mut frame = from.clone();
        let form = self.refined(&mut frame, form, q, &[]);
        let (form, fit) = self.fit_trimmed(&mut frame, &[], form, q, ROUNDS[0])?;
        Ok(ChainEffect::of_law(form, fit, frame))
    }
    /// The shape once more along the hypothesis' own trajectory.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn polished(&self, h: ChainEffect) -> Result<ChainEffect, TrajectoryError> {
        let Some(form) = h
            .form
            .clone()
            .filter(|f| f.parts.len() > 1 || f.parts.iter().any(|p| !f.law.refined(&p.shape).is_empty()))
        else {
            return Ok(h);
        };
        let mut frame = h.frame.clone();
        let form = self.refined(&mut frame, form, &h.fit.intensities, &[]);
        let fit = self.fit(&mut frame, std::slice::from_ref(&form), &h.fit.intensities, ROUNDS[1])?;
        Ok(if fit.evidence > h.of_fit { ChainEffect::of_law(form, fit, frame) } else { h })
    }

    /// The same cause at further joints, as long as the evidence requires it.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn extended(&self, mut h: ChainEffect) -> Result<ChainEffect, TrajectoryError> {
        let mut more = false;
        while let Some(form) = h.form.clone().filter(|f| f.law.spreads() && !h.apart) {
            if h.left.largest_of_all() <= CHAIN_SEARCH.left {
                break;
            }
            let mut frame = h.frame.clone();
            let standing = held(self.applied(&frame, std::slice::from_ref(&form)), &h.fit.amplitudes);
            let Some((found, q, gain)) = self.another_joint(&mut frame, &form, &h.fit.intensities, &standing)
            else {
                break;
            };
            if gain < CHAIN_SEARCH.more_joints {
                break;
            }
            let wider = EffectForm { parts: [&form.parts[..], &[found]].concat(), ..form };
            let next = self.attempt(&h.frame, wider, &q)?;
            if next.evidence < h.evidence + CHAIN_SEARCH.more_joints {
                break;
            }
            (h, more) = (next, true);
        }
        if more { self.polished(h) } else { Ok(h) }
    }

    /// The best shape of a law at a joint where it is not yet, in addition to the laws that are fitted: with its intensities and gain in nats;
    /// `None`: it is everywhere, or at several joints together.
    pub(super) fn another_joint(
        &self,
        frame: &mut TrajectoryFrame,
        form: &EffectForm,
        q: &[f64],
        standing: &[AppliedLaw],
    ) -> Option<(FormPart, Vec<f64>, f64)> {
        if form.parts.iter().any(|p| p.shape.joints.len() != 1) {
            return None;
        }
        let mut all = self.shapes(frame, |law, shape| {
            let new = |j: &usize| form.parts.iter().all(|p| p.shape.joints[0] != *j);
            law.id() == form.law.id() && shape.joints.len() == 1 && shape.joints.iter().all(new)
        });
        if all.is_empty() {
            return None;
        }
        let bank = chain_bank(frame, q, &[1.0, 0.2]);
        let alone = chain_screening(frame, standing).look(frame, &mut all, &bank);
        let best = all.into_iter().filter(ScreenedShape::is_possible).reduce(ScreenedShape::or_better);
        best.map(|b| {
            let part = FormPart { shape: b.shape, left_out: Vec::new() };
            (part, b.intensities, b.evidence - alone)
        })
    }

    /// The shapes that `wanted` takes along the present trajectory of a frame, with the orders of its scores; what is known of the case has
    /// none.
    pub fn shapes(
        &self,
        frame: &TrajectoryFrame,
        wanted: impl Fn(LawRef, &LawShape) -> bool,
    ) -> Vec<ScreenedShape> {
        let orders = chain_orders(frame);
        let late =
            |law: LawRef, shape: &LawShape| law.is_late() && shape.channels.iter().any(|c| frame.is_late(*c));
        let open = |law: LawRef, shape: &LawShape| {
            frame.plant.can_have(law.id())
                && wanted(law, shape)
                && !self.is_known(law.id(), shape.place, &shape.joints)
                && !late(law, shape)
        };
        self.along(frame, |along| chain_shapes(along, &orders, open))
    }

    /// Whether the case declares an effect that acts at a place, at one of these joints if it is at joints.
    pub(super) fn is_known(&self, id: &str, place: &str, joints: &[usize]) -> bool {
        self.structures.known.iter().any(|k| {
            let there = k.joints.is_empty() || joints.iter().any(|j| k.joints.contains(j));
            k.id == id && k.component == place && there
        })
    }
}

/// One number of one part's shape by pattern search.
fn refined_by(
    along: &PlantAlong<'_>,
    frame: &TrajectoryFrame,
    mut form: EffectForm,
    part: usize,
    Refinement { name, mut step, order }: Refinement,
    q: &[f64],
    screening: &mut Screening,
) -> EffectForm {
    let rounds = SEARCH.0 + if SEARCH.2.contains(&name) { SEARCH.1 } else { 0 };
    for _ in 0..rounds {
        let shape = form.parts[part].shape.clone();
        let value = shape.value(name);
        let near = |d: &f64| if order { value + d * step } else { value * (1.0 + d * step) };
        let values = AROUND[usize::from(order)].iter().map(near).chain([value]);
        let with = |v: f64| -> LawShape { shape.with(name, form.law.bounded(along, &shape, name, v)) };
        let shapes: Vec<LawShape> = values.map(with).collect();
        let mut forms = Vec::new();
        let mut candidates = Vec::new();
        for shape in shapes {
            let mut other = form.clone();
            other.parts[part].shape = shape;
            if let Some(c) = other.candidate(along) {
                candidates.push(c);
                forms.push(other);
            }
        }
        screening.look(frame, &mut candidates, &[q.to_vec()]);
        step *= 0.5;
        let best = (0..candidates.len()).filter(|k| candidates[*k].is_possible());
        let best = best.reduce(|a, b| if candidates[b].evidence > candidates[a].evidence { b } else { a });
        if let Some(k) = best {
            form = forms.swap_remove(k);
            let single = form.parts.len() == 1;
            let own = &mut form.parts[part].shape;
            own.widened = candidates[k].shape.widened.max(if single { 0 } else { own.widened });
        }
    }
    form
}

/// Scores along the trajectory of a frame with fitted laws at their amplitudes, the trajectory staying as it is.
pub fn scored(frame: &mut TrajectoryFrame, q: &[f64], standing: &[AppliedLaw]) {
    let (columns, priors) = with_laws(frame, standing);
    let packed = frame.packed(&columns);
    let gains = frame.all_gains(q, true);
    let (_, found) = frame.evidence_with(&packed, &priors, &gains);
    let own = frame.own_forces(&columns, &found.amplitudes);
    let scores: Vec<Vec<f64>> = frame.smoothed(&gains, Some(&own)).into_iter().map(|s| s.scores).collect();
    drop(gains);
    frame.runs.iter_mut().zip(scores).for_each(|(r, s)| r.scores = s);
}

/// A frame of the case with this plant: the nominal parameters, and those with which it begins.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn frame_with(
    loaded: &Loaded,
    plant: TrajectoryPlant,
    nominal: &[f64],
    theta: &[f64],
    late: &[(usize, f64)],
) -> Result<TrajectoryFrame, TrajectoryError> {
    let mut frame = TrajectoryFrame::new(loaded, plant, nominal, late)?;
    frame.theta = theta.to_vec();
    frame.linearise(&[])?;
    Ok(frame)
}
