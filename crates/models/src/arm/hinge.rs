//! An arm with a passive hinge inside one of its links: the same arm with one link more.

use super::layout::parameter;
use super::model::PlanarManipulator;

/// Least share of a link's inertia that both pieces have about their own centres of mass: a link with most of its mass at its ends
/// would have none.
const LEAST_INERTIA: f64 = 0.1;

impl PlanarManipulator {
    /// This arm, its effects left out and its payload in its link, with a rigid joint without rotor inside link `link` (from 0) at the
    /// share `at` of its length; and the parameters of that arm, of which `p` are this one's. The mass beyond the hinge is the share of
    /// the length beyond it, its centre in the middle of that piece; the link's centre of mass and, where the pieces allow, its inertia
    /// stay. `None`: the arm would have too many links.
    pub fn hinged(&self, p: &[f64], link: usize, at: f64) -> Option<(Self, Vec<f64>)> {
        let n = self.links();
        let mut flexible = self.flexible().to_vec();
        flexible.insert(link + 1, false);
        let arm = Self::on_base::<&str>(self.has_fixed_base(), &flexible, &[]).ok()?;
        let own = self.merged(p);
        let mut q = Vec::new();
        let mut from = 0;
        for (_, length) in parameter::NAMES {
            let (length, of_link) = (length(n), length(n + 1) - length(n));
            let mut values = own[from..from + length].to_vec();
            from += length;
            let here = values[of_link * link..of_link * (link + 1)].to_vec();
            values.splice(of_link * (link + 1)..of_link * (link + 1), here);
            q.extend(values);
        }
        let value = |begin: fn(usize) -> usize| own[begin(n) + link];
        let (m, inertia) = (value(parameter::link_mass), value(parameter::link_inertia));
        let length = value(parameter::link_length);
        let center = own[parameter::link_center_of_mass(n) + 2 * link];
        let (place, share) = (at * length, 1.0 - at);
        let outer = place + 0.5 * (length - place);
        let inner = (center - share * outer) / (1.0 - share);
        let apart = (1.0 - share) * m * (inner - center).powi(2) + share * m * (outer - center).powi(2);
        let each = 0.5 * (inertia - apart).max(LEAST_INERTIA * inertia);
        let pieces = [((1.0 - share) * m, inner, place), (share * m, outer - place, length - place)];
        for (k, (mass, center, length)) in (link..).zip(pieces) {
            q[parameter::link_mass(n + 1) + k] = mass;
            q[parameter::link_inertia(n + 1) + k] = each;
            q[parameter::link_length(n + 1) + k] = length;
            q[parameter::link_center_of_mass(n + 1) + 2 * k] = center;
        }
        for (begin, rigid) in [
            (parameter::motor_inertia as fn(usize) -> usize, 0.0),
            (parameter::gear_ratio, 1.0),
            (parameter::joint_stiffness, 0.0),
            (parameter::joint_damping, 0.0),
            (parameter::initial_joint_angle, 0.0),
            (parameter::initial_joint_velocity, 0.0),
            (parameter::initial_motor_angle, 0.0),
            (parameter::initial_motor_velocity, 0.0),
        ] {
            q[begin(n + 1) + link + 1] = rigid;
        }
        Some((arm, q))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::ArmScalar;

    #[test]
    fn a_hinge_at_rest_changes_no_mass_matrix() {
        let arm = PlanarManipulator::new::<&str>(&[true, false], &[]).unwrap();
        let n = 2;
        let mut p: Vec<f64> = (0..parameter::count(n)).map(|k| 0.5 + 0.1 * (k % 7) as f64).collect();
        for j in 0..n {
            p[parameter::link_mass(n) + j] = 2.0;
            p[parameter::link_inertia(n) + j] = 0.3;
            p[parameter::link_length(n) + j] = 0.8;
            p[parameter::link_center_of_mass(n) + 2 * j] = 0.35;
        }
        p[parameter::motor_coupling(n)] = 1.0;
        for link in 0..n {
            let (hinged, q) = arm.hinged(&p, link, 0.4).unwrap();
            let (own, more) = (arm.dofs(), hinged.dofs());
            assert_eq!(more, own + 1);
            let hinge = 3 + link + 1;
            let x: Vec<f64> = (0..2 * own).map(|k| 0.2 * k as f64 - 0.3).collect();
            let mut y = x.clone();
            y.insert(own + hinge, 0.0);
            y.insert(hinge, 0.0);
            let a = ArmScalar::mass_matrix(&arm, &x, &p);
            let b = ArmScalar::mass_matrix(&hinged, &y, &q);
            let kept: Vec<usize> = (0..more).filter(|k| *k != hinge).collect();
            for i in 0..own {
                for j in 0..own {
                    let (a, b) = (a.at(i, j), b.at(kept[i], kept[j]));
                    assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{link} {i} {j}: {a} {b}");
                }
            }
        }
    }
}
