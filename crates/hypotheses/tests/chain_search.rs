//! Rules of the search for effects of chains.

use trueup_hypotheses::innovations::chain_effect::{LatentLevels, rank_friction};
use trueup_hypotheses::innovations::chain_form::EffectForm;
use trueup_hypotheses::innovations::law::DryFriction;
use trueup_hypotheses::innovations::laws::arm_law_of;
use trueup_hypotheses::innovations::shape::LawShape;

const PLAIN: Option<DryFriction> = Some(DryFriction::Plain);
const FALLING: Option<DryFriction> = Some(DryFriction::Falling);

fn friction_at(joints: [usize; 2]) -> EffectForm {
    let law = arm_law_of("motor-friction", "motor-friction").unwrap();
    let of =
        |j: usize| EffectForm::new(law, LawShape::new("motor-friction", "length", &[("x", 1e-3)]).at(&[j]));
    let [mut form, other] = joints.map(of);
    form.parts.extend(other.parts);
    form
}

#[test]
fn companions_of_friction_that_come_out_negative_are_left_out_at_their_joint() {
    let form = friction_at([0, 2]);
    let amplitudes = [1.0, 0.2, 0.3, -0.2, 1.0, 0.1, -0.5, 0.05];
    let less = form.trimmed(&amplitudes).unwrap();
    assert_eq!(less.parts[0].left_out, [3]);
    assert_eq!(less.parts[1].left_out, [2]);
    // Small negative ones stay: they are rounding of none.
    assert!(less.trimmed(&[1.0, 0.2, 0.3, 1.0, 0.1, -0.05]).is_none());
    // Of those that are left the second joint's begin where the first's end.
    let least = less.trimmed(&[1.0, 0.2, 0.3, 1.0, 0.1, -0.5]).unwrap();
    assert_eq!(least.parts[1].left_out, [2, 3]);
    let ripple = arm_law_of("torque-ripple", "actuator").unwrap();
    let ripple = EffectForm::new(ripple, LawShape::new("actuator", "order", &[("h", 6.0)]));
    assert!(ripple.trimmed(&[1.0, -1.0, -1.0, -1.0]).is_none());
}

fn left(force: f64) -> LatentLevels {
    LatentLevels { forces: vec![force, 1.0], readings: vec![5.0, 20.0] }
}

#[test]
fn stribecks_friction_leads_only_if_it_leaves_less_than_the_plain_one() {
    let ranked = |plain: f64, stribeck: [f64; 2], of_plain: f64| {
        let [mut a, mut b] = [plain, stribeck[0]];
        let (of_plain, of_stribeck) = (left(of_plain), left(stribeck[1]));
        let all = vec![(PLAIN, &mut a, &of_plain), (FALLING, &mut b, &of_stribeck)];
        rank_friction(all, 0.0);
        assert_eq!(a, plain);
        b
    };
    assert_eq!(ranked(300.0, [400.0, 10.0], 100.0), 388.0);
    // One per cent of the plain one's gain.
    assert_eq!(ranked(5000.0, [5100.0, 10.0], 100.0), 5050.0);
    // It leaves as much: below the plain one.
    assert_eq!(ranked(300.0, [400.0, 95.0], 100.0), 288.0);
    // Nothing was left.
    assert_eq!(ranked(300.0, [400.0, 2.0], 2.0), 388.0);
    let mut alone = 400.0;
    let of = left(10.0);
    rank_friction(vec![(FALLING, &mut alone, &of)], 0.0);
    assert_eq!(alone, 400.0);
}

#[test]
fn power_of_latents_counts_errors_of_readings_as_a_tenth() {
    let l = LatentLevels { forces: vec![1.0, 3.0], readings: vec![5.0, 40.0] };
    assert_eq!(l.largest(), 4.0);
    assert_eq!(l.largest_of_all(), 40.0);
    assert_eq!(l.power(), 1.0 + 8.0 + 15.0);
}
