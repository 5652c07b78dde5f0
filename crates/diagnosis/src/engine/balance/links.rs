//! How the coordinates of a model hang together with the channels of a recording.

use trueup_numerics::Scalar;

use super::prescribed::GriddedRecording;
use crate::engine::coordinate::CoordinateReadings;
use crate::engine::subject::EngineModel;

/// How the coordinates of a model hang together with the channels of a recording.
#[derive(Clone, Debug)]
pub struct Links {
    /// Channel that prescribes each coordinate, as factor times it, and whether it shows its velocity only.
    pub(super) leads: Vec<Option<(usize, f64, bool)>>,
    /// Which coordinate each channel shows, as factor times it, and whether its velocity.
    pub(super) shows: Vec<Option<(usize, f64, bool)>>,
    /// States set by the coordinates' positions and velocities: state, (coordinate, factor).
    pub(super) positions: Vec<(usize, Vec<(usize, f64)>)>,
    pub(super) velocities: Vec<(usize, Vec<(usize, f64)>)>,
    /// States with the position of a coordinate that nothing prescribes.
    pub(super) unprescribed: Vec<(usize, Vec<(usize, f64)>)>,
    /// Rows of the equations whose accelerations are as measured while others are integrated: row, coordinate, factor.
    pub(super) given: Vec<(usize, usize, f64)>,
    /// State that is each coordinate's velocity.
    pub(super) velocity: Vec<usize>,
    /// States to be integrated: those that follow, others.
    pub(super) followers: Vec<usize>,
    pub(super) free: Vec<usize>,
    /// Velocities with dry friction that are integrated, and those that are prescribed (coordinate).
    pub(super) stops: Vec<usize>,
    pub(super) held: Vec<usize>,
}

impl GriddedRecording {
    /// How these coordinates of that model are prescribed.
    pub fn links(&self, model: &EngineModel, coordinates: &[CoordinateReadings]) -> Links {
        let find =
            |list: &[(usize, f64)], output: usize| list.iter().find(|(o, _)| *o == output).map(|l| l.1);
        let as_it_is = coordinates.len() == self.leading.coordinates.len();
        let mut leads = Vec::new();
        for (i, c) in coordinates.iter().enumerate() {
            if self.leading.coordinates.get(i) == Some(&false) && as_it_is {
                leads.push(None);
                continue;
            }
            let best = |list: &[(usize, f64)]| {
                let seen =
                    self.channels.iter().enumerate().filter(|(k, _)| !self.leading.secondary.contains(k));
                seen.filter_map(|(k, s)| Some((k, find(list, s.output)?, s.sigma)))
                    .min_by(|a, b| (a.2 / a.1.abs()).total_cmp(&(b.2 / b.1.abs())))
                    .map(|(k, f, _)| (k, f))
            };
            let prescribed = best(&c.positions).map(|(k, f)| (k, f, false));
            leads.push(prescribed.or_else(|| best(&c.velocities).map(|(k, f)| (k, f, true))));
        }
        let shows = self.channels.iter().map(|s| {
            coordinates.iter().enumerate().find_map(|(i, c)| {
                find(&c.positions, s.output)
                    .map(|f| (i, f, false))
                    .or_else(|| find(&c.velocities, s.output).map(|f| (i, f, true)))
            })
        });
        let sum = |of: &dyn Fn(&CoordinateReadings) -> Vec<(usize, f64)>| {
            let mut all: Vec<(usize, Vec<(usize, f64)>)> = Vec::new();
            for (i, c) in coordinates.iter().enumerate() {
                for (state, factor) in of(c) {
                    match all.iter_mut().find(|a| a.0 == state) {
                        Some(a) => a.1.push((i, factor)),
                        None => all.push((state, vec![(i, factor)])),
                    }
                }
            }
            all.into_iter().partition::<Vec<_>, _>(|a| a.1.iter().all(|(i, _)| leads[*i].is_some()))
        };
        let (positions, unprescribed) = sum(&|c| c.position.clone());
        let (velocities, _) = sum(&|c| c.velocity.clone());
        let prescribed = |s: &usize| positions.iter().chain(&velocities).any(|p| p.0 == *s);
        let followers = model.plant().followers().to_vec();
        let free = (0..model.sizes().states).filter(|s| !prescribed(s) && !followers.contains(s)).collect();
        let (held, stops): (Vec<usize>, Vec<usize>) = (0..coordinates.len())
            .filter(|i| coordinates[*i].held.is_some())
            .partition(|i| leads[*i].is_some());
        let velocity: Vec<usize> =
            coordinates.iter().map(|c| c.velocity.first().map_or(0, |v| v.0)).collect();
        // With accelerations that the model computes a motor may run away: what was measured holds it.
        let given = if leads.iter().all(Option::is_some) || as_it_is && !self.leading.as_measured {
            Vec::new()
        } else {
            let one = |(state, parts): &(usize, Vec<(usize, f64)>)| {
                let (coordinate, factor) = *parts.first()?;
                Some((model.row_of(*state)?, coordinate, factor))
            };
            velocities.iter().filter_map(one).collect()
        };
        Links {
            given,
            stops: stops.into_iter().map(|i| velocity[i]).collect(),
            held,
            velocity,
            shows: shows.collect(),
            positions,
            velocities,
            unprescribed,
            followers,
            free,
            leads,
        }
    }
}

impl Links {
    /// The position of a coordinate that is not prescribed: from a state that depends on it.
    pub(super) fn position<T: Scalar>(&self, i: usize, coordinate: &[[T; 3]], x: &[T]) -> T {
        let Some((state, parts)) = self.unprescribed.iter().find(|u| u.1.iter().any(|p| p.0 == i)) else {
            return T::zero();
        };
        let mut rest = x[*state];
        let mut own = 1.0;
        for (j, f) in parts {
            if *j == i {
                own = *f;
            } else {
                rest -= coordinate[*j][0] * *f;
            }
        }
        rest / own
    }
    /// Channels of positions whose coordinate another one prescribes, and that one.
    pub fn secondary(&self) -> Vec<[usize; 2]> {
        let other = |c: usize| match self.shows[c] {
            Some((i, _, false)) => self.lead_of(i).filter(|l| *l != c).map(|l| [c, l]),
            _ => None,
        };
        (0..self.shows.len()).filter_map(other).collect()
    }
    /// Coordinates that nothing prescribes.
    pub fn unprescribed(&self) -> impl Iterator<Item = usize> {
        self.leads.iter().enumerate().filter(|l| l.1.is_none()).map(|l| l.0)
    }
    /// The channel that prescribes a coordinate.
    pub fn lead_of(&self, coordinate: usize) -> Option<usize> {
        self.leads.get(coordinate).copied().flatten().map(|l| l.0)
    }
    /// Accelerations of the rows that are given.
    pub(super) fn accelerations<T: Scalar>(&self, coordinate: &[[T; 3]], out: &mut Vec<(usize, T)>) {
        out.clear();
        out.extend(self.given.iter().map(|(row, i, f)| (*row, coordinate[*i][2] * *f)));
    }
    pub(super) fn lead<T: Scalar>(&self, coordinate: &[[T; 3]], x: &mut [T]) {
        for (list, d) in [(&self.positions, 0), (&self.velocities, 1)] {
            for (state, parts) in list {
                x[*state] = parts.iter().fold(T::zero(), |sum, (i, f)| sum + coordinate[*i][d] * *f);
            }
        }
    }
}
