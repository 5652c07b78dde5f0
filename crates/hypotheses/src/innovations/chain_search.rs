//! What explains the gap of a chain: the model alone, a screen of all shapes at once, leaders refined and fitted, late channels and other
//! structures in frames of their own, impulses, and a second for what the first leaves. All evidences are of the same readings.

use trueup_estimation::innovations::trajectory::case_frame::{fit_chain_null, prepared};
use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryError;
use trueup_estimation::innovations::trajectory::structures::{CasePlantError, PlantStructures};
use trueup_signals::Loaded;

use super::candidate::ScreenedShape;
use super::chain_along::ChainSizes;
use super::chain_effect::{ChainEffect, LatentLevels, best_of_each, rank_friction};
use super::chain_fits::{ChainFits, scored};
use super::chain_form::EffectForm;
use super::chain_pairs::{ChainPair, plain_shape};
use super::chain_pushes::PushSearch;
use super::chain_screen::{LOOKS, best_of_chain, chain_bank, chain_screening, chain_survey};
use super::law::DryFriction;
use super::laws::{LawRef, arm_law_of};
use super::levels::CHAIN_SEARCH;
use super::shape::LawShape;

/// Rounds of plain friction in place of Stribeck's.
const ROUNDS: usize = 5;
/// Families that are fitted: of the screen, of impulses.
const LEADERS: [usize; 2] = [6, 2];
/// Speeds with which Stribeck's term begins on top of plain friction, in usual ones.
const SPEEDS: [f64; 4] = [0.06, 0.15, 0.35, 0.7];
/// Late channels that have a frame, at most.
const LATE: usize = 3;
/// Effects in addition to which a second is looked for.
const FIRST: usize = 2;

/// An arm that cannot be searched.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChainSearchError {
    /// Its plant.
    #[error(transparent)]
    Plant(#[from] CasePlantError),
    /// Its fits.
    #[error(transparent)]
    Fit(#[from] TrajectoryError),
}

/// The model alone.
#[derive(Clone)]
pub struct ChainNull {
    /// With the nominal parameters.
    pub nominal: f64,
    /// With refitted ones.
    pub fit: TrajectoryFit,
    /// The latents that are left then.
    pub left: LatentLevels,
}

/// All that a verdict is made from.
pub struct ChainFindings {
    /// The model alone.
    pub null: ChainNull,
    /// Evidence of the screen without any effect.
    pub base: f64,
    /// The best shape of each family of the screen, best first.
    pub screen: Vec<ScreenedShape>,
    /// Effects, best first.
    pub effects: Vec<ChainEffect>,
    /// Pairs, best first.
    pub pairs: Vec<ChainPair>,
    /// Usual sizes: units of the amplitudes.
    pub sizes: ChainSizes,
}

/// Fits the model alone; leaves a frame where hypotheses begin.
///
/// # Errors
/// See [`ChainSearchError`].
pub fn chain_null(
    loaded: &Loaded,
    structures: &PlantStructures,
) -> Result<(TrajectoryFrame, ChainNull), ChainSearchError> {
    let (mut frame, nominal, fit) = fit_chain_null(loaded, structures)?;
    scored(&mut frame, &fit.intensities, &[]);
    let left = LatentLevels::of(&frame, &fit.intensities);
    Ok((frame, ChainNull { nominal, fit, left }))
}

/// Searches a case of an arm.
///
/// # Errors
/// See [`ChainSearchError`].
pub fn search_chain(
    loaded: &Loaded,
    structures: &PlantStructures,
) -> Result<ChainFindings, ChainSearchError> {
    let loaded = &*prepared(loaded, structures)?;
    let (mut frame, null) = chain_null(loaded, structures)?;
    let fits = ChainFits { loaded, structures, sizes: ChainSizes::of(&frame) };
    let mut shapes = fits.shapes(&frame, |_, _| true);
    let mut screening = chain_screening(&mut frame, &[]);
    let base = chain_survey(&frame, &mut screening, &mut shapes, &null.fit.intensities, LOOKS);
    drop(screening);
    let first: Vec<ScreenedShape> = best_of_chain(&shapes);
    let mut search = ChainSearch { fits, frame, null, base, first, effects: Vec::new() };
    search.leaders(&search.first.clone(), LEADERS[0])?;
    search.again()?;
    search.apart()?;
    search.pushed()?;
    search.effects = best_of_each(std::mem::take(&mut search.effects));
    let pairs = search.pairs()?;
    let ChainSearch { fits, null, base, first, effects, .. } = search;
    Ok(ChainFindings { null, base, screen: first, effects, pairs, sizes: fits.sizes })
}

/// A search under way.
struct ChainSearch<'a> {
    fits: ChainFits<'a>,
    /// Where hypotheses begin.
    frame: TrajectoryFrame,
    null: ChainNull,
    base: f64,
    first: Vec<ScreenedShape>,
    effects: Vec<ChainEffect>,
}

impl ChainSearch<'_> {
    fn explains_all(&self, left: &LatentLevels) -> bool {
        left.largest() < CHAIN_SEARCH.left || left.power() < CHAIN_SEARCH.all * self.null.left.power()
    }
    fn any_explains_all(&self) -> bool {
        self.effects.iter().any(|h| self.explains_all(&h.left))
    }
    fn gain(&self, h: &ChainEffect) -> f64 {
        h.evidence - self.null.fit.evidence
    }
    fn best_gain(&self) -> f64 {
        self.effects.iter().map(|h| self.gain(h)).reduce(f64::max).unwrap_or(0.0)
    }
    fn screened(&self, c: &ScreenedShape) -> f64 {
        c.evidence - self.base
    }

    /// The first of the screen, refined and fitted.
    fn leaders(&mut self, families: &[ScreenedShape], most: usize) -> Result<(), ChainSearchError> {
        let best = families.first().map_or(0.0, |f| self.screened(f));
        let levels = CHAIN_SEARCH;
        for c in families.iter().filter(|c| !c.law.is_structure()).take(most) {
            let top = self.best_gain();
            let leads = |h: &&ChainEffect| self.gain(h) > CHAIN_SEARCH.leads * top;
            let calm = self.effects.iter().filter(leads).any(|h| self.explains_all(&h.left));
            let gain = self.screened(c);
            let share = if calm { levels.fitted_share_calm } else { levels.fitted_share };
            let others = !self.effects.is_empty();
            if gain < levels.fitted_alone
                || others && (gain < levels.fitted || gain < share * best.max(0.5 * top))
            {
                continue;
            }
            let h = self.fits.attempt(&self.frame, EffectForm::of(c), &c.intensities)?;
            self.effects.push(h);
        }
        Ok(())
    }

    /// Leaders once more along their own trajectories, at further joints, and Stribeck's friction on top of the plain one.
    fn again(&mut self) -> Result<(), ChainSearchError> {
        let null = self.null.fit.evidence;
        let mut all = best_of_each(std::mem::take(&mut self.effects));
        let top = all.first().map_or(0.0, |h| h.evidence - null);
        let better = |fits: &ChainFits<'_>, h: ChainEffect| -> Result<ChainEffect, TrajectoryError> {
            let chosen = top > CHAIN_SEARCH.again
                && h.evidence - null > CHAIN_SEARCH.again_share * top
                && !h.is_impulses();
            if chosen { fits.extended(fits.polished(h)?) } else { Ok(h) }
        };
        let stribeck =
            all.iter().position(|h| h.dry_friction() == Some(DryFriction::Falling)).map(|k| all.remove(k));
        let mut all: Vec<ChainEffect> =
            all.into_iter().map(|h| better(&self.fits, h)).collect::<Result<_, _>>()?;
        let laws = ["motor-friction", "stribeck-friction"].map(|id| arm_law_of(id, "motor-friction"));
        if let (Some(sb), [Some(plain), Some(falling)]) = (stribeck, laws) {
            let mut frame = sb.frame.clone();
            let form = sb.form.as_ref().map(|f| f.with_law(plain, plain_shape));
            if let Some(form) = form {
                let fit =
                    self.fits.fit(&mut frame, std::slice::from_ref(&form), &sb.fit.intensities, ROUNDS)?;
                let own = ChainEffect::of_law(form, fit, frame);
                let others = all.iter().filter(|h| h.dry_friction() == Some(DryFriction::Plain));
                let best = others.reduce(|a, b| if b.evidence > a.evidence { b } else { a }).cloned();
                let best = match best {
                    Some(best) if best.evidence >= own.evidence => best,
                    _ => better(&self.fits, own.clone())?,
                };
                all.extend([own, sb]);
                if best.evidence - null > CHAIN_SEARCH.again_share * top {
                    all.extend(self.on_top(&best, falling)?);
                }
                all.push(best);
            }
        }
        let mut all = best_of_each(all);
        rank_friction(all.iter_mut().map(|h| (h.dry_friction(), &mut h.evidence, &h.left)).collect(), null);
        self.effects = best_of_each(all);
        Ok(())
    }

    /// Stribeck's term on top of plain friction, at all its joints.
    fn on_top(&self, plain: &ChainEffect, falling: LawRef) -> Result<Option<ChainEffect>, ChainSearchError> {
        let Some(form) = &plain.form else { return Ok(None) };
        let mut frame = plain.frame.clone();
        let q = &plain.fit.intensities;
        let with = |share: &f64| {
            form.with_law(falling, |shape| {
                let motor = frame.plant.drives[shape.joint()];
                let mut values = vec![("speed", share * self.fits.sizes.speed[motor]), ("k", 1.0)];
                values.extend(shape.values.iter().filter(|v| v.0 == "x"));
                LawShape { form: "stribeck", values, ..shape.clone() }
            })
        };
        let forms: Vec<EffectForm> = SPEEDS.iter().map(with).collect();
        let mut all: Vec<ScreenedShape> =
            self.fits.along(&frame, |along| forms.iter().filter_map(|f| f.candidate(along)).collect());
        let bank = chain_bank(&frame, q, &[1.0, 0.3]);
        chain_screening(&mut frame, &[]).look(&frame, &mut all, &bank);
        let best = (0..all.len()).reduce(|a, b| if all[b].evidence > all[a].evidence { b } else { a });
        let Some(k) = best else { return Ok(None) };
        let mut form = forms[k].clone();
        let widened = all[k].shape.widened;
        form.parts.iter_mut().for_each(|p| p.shape.widened = p.shape.widened.max(widened));
        let h = self.fits.attempt(&plain.frame, form, q)?;
        Ok(Some(self.fits.polished(h)?))
    }

    /// Late channels, and springs in rigid joints, each in a frame of its own.
    fn apart(&mut self) -> Result<(), ChainSearchError> {
        let q = self.null.fit.intensities.clone();
        let best = self.first.first().map_or(0.0, |f| self.screened(f));
        let late = self.first.iter().filter(|c| c.law.is_late()).take(LATE);
        let [nats, share] = CHAIN_SEARCH.late;
        let late: Vec<ScreenedShape> =
            late.filter(|c| self.screened(c) > nats.max(share * best)).cloned().collect();
        for c in late {
            let found = self.fits.retimed(&self.frame, &c.shape.channels, c.shape.value("d"), &q)?;
            self.effects.extend(found);
        }
        if !self.any_explains_all() && self.null.left.largest() > CHAIN_SEARCH.loud[0] {
            let groups = self.frame.intake.groups.clone();
            for (_, channels) in groups.iter().filter(|g| !g.0.contains('+')) {
                if let Some(delay) = self.fits.long_delay(&self.frame, channels)? {
                    self.effects.extend(self.fits.retimed(&self.frame, channels, delay, &q)?);
                }
            }
        }
        if !self.any_explains_all() {
            for j in 0..self.frame.plant.drives.len() {
                let loud = self.null.left.forces[self.frame.plant.joints[j]] > CHAIN_SEARCH.loud[1];
                if !self.frame.plant.flexible(j) && loud {
                    self.effects.extend(self.fits.with_spring(&self.frame, j)?);
                }
            }
        }
        Ok(())
    }

    /// Impulses, unless something explains all.
    fn pushed(&mut self) -> Result<(), ChainSearchError> {
        if self.any_explains_all() {
            return Ok(());
        }
        let q = self.null.fit.intensities.clone();
        let mut all = Vec::new();
        let places = self.fits.pushed_places(&self.frame, &q);
        if places.is_empty() {
            return Ok(());
        }
        let mut search = PushSearch::new(&self.frame, &q, &[]);
        let mut screening = chain_screening(&mut self.frame, &[]);
        for place in places {
            let Some(form) = search.on(&self.fits, place) else { continue };
            let mut found: Vec<ScreenedShape> =
                self.fits.along(&self.frame, |along| form.candidate(along)).into_iter().collect();
            let bank = chain_bank(&self.frame, &q, &[1.0, 0.3, 0.1]);
            screening.look(&self.frame, &mut found, &bank);
            found.iter_mut().for_each(|f| f.evidence -= CHAIN_SEARCH.each_push * form.pulses() as f64);
            all.extend(found);
        }
        let families = best_of_chain(&all);
        self.leaders(&families, LEADERS[1])?;
        self.first.extend(families);
        self.first.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        Ok(())
    }

    /// Seconds in addition to the first effects.
    fn pairs(&mut self) -> Result<Vec<ChainPair>, ChainSearchError> {
        let mut pairs: Vec<ChainPair> = Vec::new();
        let best = self.effects.first().map_or(0.0, |h| self.gain(h));
        let [nats, share] = CHAIN_SEARCH.first;
        for h in self.effects.iter().take(FIRST).cloned().collect::<Vec<_>>() {
            let little =
                self.gain(&h) < nats.max(share * best) || h.left.largest_of_all() < CHAIN_SEARCH.left;
            if little || pairs.iter().any(|p| self.explains_all(&p.left)) {
                continue;
            }
            let found = self.fits.seconds(&h)?;
            pairs.extend(found.pairs);
            if let Some(c) = found.alone.first().filter(|_| !h.apart) {
                let own = self.fits.attempt(&self.frame, EffectForm::of(c), &c.intensities)?;
                self.effects.push(own);
                self.effects = best_of_each(std::mem::take(&mut self.effects));
            }
        }
        pairs.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        Ok(pairs)
    }
}
