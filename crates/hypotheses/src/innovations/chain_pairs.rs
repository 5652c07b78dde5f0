//! A second effect of a chain for what the first leaves, along the first's own trajectory.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryError;

use super::candidate::ScreenedShape;
use super::chain_effect::{ChainEffect, LatentLevels, place_of, rank_friction};
use super::chain_fits::{ChainFits, scored};
use super::chain_form::EffectForm;
use super::chain_pushes::PushSearch;
use super::chain_screen::{best_of_chain, chain_bank, chain_screening, chain_survey, with_laws};
use super::law::DryFriction;
use super::laws::arm_law_of;
use super::levels::CHAIN_SEARCH;
use super::pairs::held;
use super::shape::LawShape;
use super::verdict::ReportedEffect;

/// Factors of the intensities of the survey in addition to a first effect.
const LOOKS: (f64, &[f64]) = (0.2, &[1.0]);
/// Families of seconds that are looked at, and fitted.
const SECONDS: [usize; 2] = [3, 2];
/// Eigenvalues below this share of the largest are none: columns in single precision.
const RANK: f64 = 1e-12;
/// Rounds of a fit of two.
const ROUNDS: usize = 4;

/// Two effects of a chain, fitted together.
#[derive(Clone)]
pub struct ChainPair {
    /// The first.
    pub first: ChainEffect,
    /// The second.
    pub second: EffectForm,
    /// Log evidence with the priors of both shapes, nats.
    pub evidence: f64,
    /// Where the fit ended.
    pub fit: TrajectoryFit,
    /// Amplitudes of the first, which come before those of the second.
    pub of_first: usize,
    /// The latents that both leave.
    pub left: LatentLevels,
    frame: TrajectoryFrame,
}

impl ChainPair {
    /// Effects and places as they are reported.
    pub fn named(&self) -> [ReportedEffect; 2] {
        let second = (self.second.law.id(), place_of(&self.first.frame, self.second.shape()));
        [(self.first.id, self.first.place()), second]
    }
}

/// What a search for second effects found.
#[derive(Default)]
pub struct ChainSeconds {
    /// Both together.
    pub pairs: Vec<ChainPair>,
    /// What can do all that the first does.
    pub alone: Vec<ScreenedShape>,
}

impl ChainFits<'_> {
    /// Everything else in addition to an effect; `null`: the evidence without any.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn seconds(&self, h: &ChainEffect) -> Result<ChainSeconds, TrajectoryError> {
        let mut here = h.frame.clone();
        let q = &h.fit.intensities;
        let own: Vec<EffectForm> = h.form.iter().cloned().collect();
        let standing = held(self.applied(&here, &own), &h.fit.amplitudes);
        scored(&mut here, q, &standing);
        let motor = |place: &str| place == "motor-friction";
        let mut all = self.shapes(&here, |law, shape| {
            let alike = motor(h.shape.place) && motor(shape.place);
            law.id() != h.id && !law.is_structure() && !alike
        });
        let mut screening = chain_screening(&mut here, &standing);
        let base = chain_survey(&here, &mut screening, &mut all, q, LOOKS);
        let families: Vec<ScreenedShape> = best_of_chain(&all).into_iter().take(SECONDS[0]).collect();
        let mut out = ChainSeconds::default();
        self.beside(h, &here, &own, &standing, &families, base, &mut out)?;
        let quiet = |p: &ChainPair| {
            p.left.largest() < CHAIN_SEARCH.left || p.left.power() < CHAIN_SEARCH.quiet * h.left.power()
        };
        let places = if h.is_impulses() { Vec::new() } else { self.pushed_places(&here, q) };
        if !places.is_empty() && !out.pairs.iter().any(quiet) {
            let mut more = Vec::new();
            let mut search = PushSearch::new(&here, q, &standing);
            for place in places {
                let Some(form) = search.on(self, place) else { continue };
                let found = self.along(&here, |along| form.candidate(along));
                let mut found: Vec<ScreenedShape> = found.into_iter().collect();
                screening.look(&here, &mut found, &chain_bank(&here, q, &[1.0, 0.2]));
                found.iter_mut().for_each(|f| f.evidence -= CHAIN_SEARCH.each_push * form.pulses() as f64);
                more.extend(found);
            }
            let best = families.first().map(|f| f.evidence - 0.5 * (f.evidence - base).max(0.0));
            more.retain(|m| best.is_none_or(|b| m.evidence > b));
            self.beside(h, &here, &own, &standing, &more, base, &mut out)?;
        }
        self.plain_second(h, &own, &mut out)?;
        rank_friction(
            out.pairs.iter_mut().map(|p| (p.second.law.dry_friction(), &mut p.evidence, &p.left)).collect(),
            h.evidence,
        );
        Ok(out)
    }

    /// Plain friction in addition to a first whose second is Stribeck's.
    fn plain_second(
        &self,
        h: &ChainEffect,
        own: &[EffectForm],
        out: &mut ChainSeconds,
    ) -> Result<(), TrajectoryError> {
        let plain = |p: &ChainPair| p.second.dry_friction() == Some(DryFriction::Plain);
        let Some(first) = out.pairs.first().filter(|p| p.second.dry_friction() == Some(DryFriction::Falling))
        else {
            return Ok(());
        };
        let law = arm_law_of("motor-friction", "motor-friction");
        if let Some(law) = law.filter(|_| !out.pairs.iter().any(plain)) {
            let form = first.second.with_law(law, plain_shape);
            out.pairs.push(self.together(h, h.frame.clone(), own, form, &h.fit.intensities)?);
        }
        Ok(())
    }

    fn beside(
        &self,
        h: &ChainEffect,
        here: &TrajectoryFrame,
        own: &[EffectForm],
        standing: &[AppliedLaw],
        found: &[ScreenedShape],
        base: f64,
        out: &mut ChainSeconds,
    ) -> Result<(), TrajectoryError> {
        let q = &h.fit.intensities;
        let mut found: Vec<&ScreenedShape> =
            found.iter().filter(|c| c.evidence > base + CHAIN_SEARCH.second).collect();
        found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        let mut fitted = 0;
        for c in found {
            let mut z = here.clone();
            let second = &c.terms.applied;
            if !standing.is_empty() && spanned(&mut z, q, standing, second, &c.amplitudes) > CHAIN_SEARCH.same
            {
                continue;
            }
            if let [first] = standing
                && !h.apart
                && spanned(&mut z, q, std::slice::from_ref(second), first, &h.fit.amplitudes)
                    > CHAIN_SEARCH.same
            {
                out.alone.push(c.clone());
                continue;
            }
            let form = self.refined(&mut z, EffectForm::of(c), &c.intensities, standing);
            let pair = self.together(h, z, own, form, &c.intensities)?;
            out.pairs.push(self.widened(h, own, pair)?);
            fitted += 1;
            if fitted == SECONDS[1] {
                break;
            }
        }
        Ok(())
    }

    fn together(
        &self,
        h: &ChainEffect,
        mut z: TrajectoryFrame,
        own: &[EffectForm],
        form: EffectForm,
        q: &[f64],
    ) -> Result<ChainPair, TrajectoryError> {
        let (second, fit) = self.fit_trimmed(&mut z, own, form, q, ROUNDS)?;
        let evidence =
            fit.evidence - (h.of_fit - h.evidence) - CHAIN_SEARCH.each_push * second.pulses() as f64;
        let (of_first, left) = (h.fit.amplitudes.len(), LatentLevels::of(&z, &fit.intensities));
        Ok(ChainPair { first: h.clone(), second, evidence, fit, of_first, left, frame: z })
    }

    /// The second at further joints too, as long as the evidence requires it.
    fn widened(
        &self,
        h: &ChainEffect,
        own: &[EffectForm],
        mut pair: ChainPair,
    ) -> Result<ChainPair, TrajectoryError> {
        while pair.second.law.spreads() && pair.left.largest_of_all() > CHAIN_SEARCH.left {
            let mut z = pair.frame.clone();
            let both: Vec<EffectForm> = own.iter().chain([&pair.second]).cloned().collect();
            let standing = held(self.applied(&z, &both), &pair.fit.amplitudes);
            scored(&mut z, &pair.fit.intensities, &standing);
            let found = self.another_joint(&mut z, &pair.second, &pair.fit.intensities, &standing);
            let Some((part, q, _)) = found.filter(|f| f.2 >= CHAIN_SEARCH.more_joints) else { break };
            let form = EffectForm { parts: [&pair.second.parts[..], &[part]].concat(), ..pair.second };
            let next = self.together(h, pair.frame.clone(), own, form, &q)?;
            if next.evidence < pair.evidence + CHAIN_SEARCH.more_joints {
                break;
            }
            pair = next;
        }
        Ok(pair)
    }
}

/// A shape of Stribeck's friction as one of the plain.
pub(super) fn plain_shape(shape: &LawShape) -> LawShape {
    let values = shape.values.iter().filter(|v| v.0 == "x").copied().collect();
    super::shape::LawShape { form: "length", values, ..shape.clone() }
}

/// Share of what a law at these amplitudes explains in addition to the parameters that others can do as well.
fn spanned(
    frame: &mut TrajectoryFrame,
    q: &[f64],
    by: &[AppliedLaw],
    law: &AppliedLaw,
    amplitudes: &[f64],
) -> f64 {
    let (mut columns, priors) = with_laws(frame, by);
    let (others, parameters) =
        (columns.len(), columns.len() - by.iter().map(|l| l.columns.len()).sum::<usize>());
    let priors = priors.with_laws(std::slice::from_ref(law), &mut columns);
    let packed = frame.packed(&columns);
    let gains = frame.all_gains(q, false);
    let (gram, _) = frame.evidence_with(&packed, &priors, &gains);
    let weights: Vec<(usize, f64)> =
        amplitudes.iter().enumerate().map(|(k, a)| (others + k + 1, *a)).collect();
    let product = |i: usize| weights.iter().map(|(k, a)| a * gram.product(i, *k)).sum::<f64>();
    let whole: f64 = weights.iter().map(|(k, a)| a * product(*k)).sum();
    let rest = |count: usize| {
        let size = |i: usize| gram.product(i + 1, i + 1).sqrt() + 1e-12;
        let a = DMatrix::from_fn(count, count, |i, j| gram.product(i + 1, j + 1) / (size(i) * size(j)));
        let b = DVector::from_fn(count, |i, _| product(i + 1) / size(i));
        let eigen = SymmetricEigen::new(a);
        let most = eigen.eigenvalues.max();
        let along = eigen.eigenvectors.transpose() * b;
        let pairs = along.iter().zip(eigen.eigenvalues.iter()).filter(|(_, e)| **e > RANK * most);
        whole - pairs.map(|(x, e)| x * x / e).sum::<f64>()
    };
    1.0 - rest(others) / rest(parameters)
}
