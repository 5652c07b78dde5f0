//! From the two stages of a gearbox to the equivalent one (S3 section 3.2), and quantities on both of its sides.

use trueup_numerics::Scalar;
use trueup_plant::PlantQuantity;

use crate::effect::PlantKind;

/// One reduction stage: planetary gear or harmonic drive. Stiffness and damping on the stage's input side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<T> {
    /// Moment of inertia at the stage's input, kg.m2.
    pub inertia: T,
    /// Stiffness K, N.m/rad.
    pub stiffness: T,
    /// Damping D, N.m.s/rad.
    pub damping: T,
    /// Gear ratio n >= 1.
    pub ratio: T,
}

/// What the two-mass model needs, on the motor side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equivalent<T> {
    /// K_eq, N.m/rad.
    pub stiffness: T,
    /// D_eq, N.m.s/rad.
    pub damping: T,
    /// n_eq.
    pub ratio: T,
    /// J_motor = J_m + J_pl, kg.m2.
    pub motor_inertia: T,
    /// J_load = J_l + J_hd n_hd^2, kg.m2.
    pub load_inertia: T,
}

/// Two stages in series, the planetary gear on the motor (GB-1).
///
/// K_eq = K_pl K_hd / (K_hd + K_pl n_pl^2) as printed in S3. The printed D_eq ([`printed_damping`]) is no series damping (twice too
/// large for two equal stages); to first order in the damping the right one is
/// D_eq = (K_hd^2 D_pl + n_pl^2 K_pl^2 D_hd) / (K_hd + K_pl n_pl^2)^2.
/// Checked by golden facts D01-D03.
pub fn series<T: Scalar>(
    planetary: &Stage<T>,
    harmonic_drive: &Stage<T>,
    motor_inertia: T,
    load_inertia: T,
) -> Equivalent<T> {
    let (pl, hd) = (planetary, harmonic_drive);
    let behind = pl.stiffness * pl.ratio * pl.ratio;
    let sum = hd.stiffness + behind;
    let weighted = hd.stiffness * hd.stiffness * pl.damping + behind * pl.stiffness * hd.damping;
    Equivalent {
        stiffness: pl.stiffness * hd.stiffness / sum,
        damping: weighted / (sum * sum),
        ratio: pl.ratio * hd.ratio,
        motor_inertia: motor_inertia + pl.inertia,
        load_inertia: load_inertia + hd.inertia * hd.ratio * hd.ratio,
    }
}

/// D_eq as S3 prints it: (K_hd D_pl + K_pl D_hd) / (K_hd + K_pl n_pl^2), N.m.s/rad.
pub fn printed_damping(planetary: &Stage<f64>, harmonic_drive: &Stage<f64>) -> f64 {
    let (pl, hd) = (planetary, harmonic_drive);
    (hd.stiffness * pl.damping + pl.stiffness * hd.damping)
        / (hd.stiffness + pl.stiffness * pl.ratio * pl.ratio)
}

/// A quantity of a drive on both sides of its gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BothSides {
    /// Seen from the motor.
    pub motor: f64,
    /// Seen from the load.
    pub load: f64,
}

/// By which power of the gear ratio n a quantity of this unit is larger on the load's side: angles turn n times less there,
/// torques are n times as large, so that the work is the same. `None`: it has no other side.
fn power(unit: &str) -> Option<i32> {
    match unit {
        "rad" | "rad/s" => Some(-1),
        "N.m" => Some(1),
        "N.m/rad" | "N.m.s/rad" | "kg.m2" => Some(2),
        "N.m/rad3" => Some(4),
        _ => None,
    }
}

/// Whether a parameter counts on the load's side as the plants define it; `None`: it is of no drive. `component`: where an effect
/// acts; `None`: the plant's own.
fn at_load(plant: PlantKind, component: Option<&str>, name: &str) -> Option<bool> {
    let name = name.split('[').next().unwrap_or(name);
    match (plant, component) {
        (_, Some(place)) if !matches!(place, "actuator" | "motor-friction" | "transmission" | "load") => None,
        (PlantKind::Joint, Some(place)) => Some(place == "load"),
        (PlantKind::Joint, None) => Some(matches!(name, "loadInertia" | "tipInertia")),
        // All of an arm's drives is joint-referred; links and base have no gear.
        (PlantKind::Arm | PlantKind::Space, Some(_)) => Some(true),
        (PlantKind::Arm | PlantKind::Space, None) => {
            let drive = name.starts_with("joint") || name.ends_with("Friction") || name == "motorInertia";
            drive.then_some(true)
        }
    }
}

/// The value of a parameter on both sides of a gear of this ratio. `None`: there is no gear, it has no other side, or it is a
/// direction rather than a size.
pub fn both_sides(
    plant: PlantKind,
    component: Option<&str>,
    q: &PlantQuantity,
    value: f64,
    ratio: f64,
) -> Option<BothSides> {
    if ratio == 1.0 || q.absolute_deviation {
        return None;
    }
    let factor = ratio.powi(power(q.unit)?);
    Some(match at_load(plant, component, &q.name)? {
        true => BothSides { motor: value / factor, load: value },
        false => BothSides { motor: value, load: value * factor },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy and power of a joint are the same whichever side they are computed on.
    #[test]
    fn both_sides_store_and_lose_the_same() {
        let ratio = 160.0;
        let sides = |name: &str, unit, value| {
            both_sides(PlantKind::Joint, None, &PlantQuantity::new(name, unit), value, ratio).unwrap()
        };
        let (twist, speed) = (0.7, 3.0);
        let stiffness = sides("stiffness", "N.m/rad", 3e-5);
        let at = sides("backlashGap", "rad", twist);
        assert_eq!(at.motor, twist);
        let energy = [stiffness.motor * at.motor.powi(2), stiffness.load * at.load.powi(2)];
        assert!((energy[0] - energy[1]).abs() < 1e-12 * energy[0]);
        let rate = sides("stribeckVelocity", "rad/s", speed);
        for (name, unit) in
            [("viscousFriction", "N.m.s/rad"), ("motorInertia", "kg.m2"), ("loadInertia", "kg.m2")]
        {
            let b = sides(name, unit, 2e-6);
            let lost = [b.motor * rate.motor.powi(2), b.load * rate.load.powi(2)];
            assert!((lost[0] - lost[1]).abs() < 1e-12 * lost[0], "{name}");
        }
        let friction = sides("coulombFriction", "N.m", 1e-3);
        assert!((friction.motor * rate.motor - friction.load * rate.load).abs() < 1e-15);
        assert_eq!(sides("loadInertia", "kg.m2", 2.0).load, 2.0);
        let of = |plant, component, name: &str, unit| {
            both_sides(plant, component, &PlantQuantity::new(name, unit), 2.0, ratio)
        };
        assert_eq!(of(PlantKind::Joint, Some("load"), "loadFriction", "N.m").map(|b| b.load), Some(2.0));
        assert_eq!(of(PlantKind::Arm, None, "jointStiffness[1]", "N.m/rad").map(|b| b.load), Some(2.0));
        assert_eq!(of(PlantKind::Arm, None, "linkInertia[1]", "kg.m2"), None);
        assert_eq!(of(PlantKind::Joint, Some("sensor:loadAngle"), "eccentricitySine", "rad"), None);
        assert_eq!(of(PlantKind::Joint, None, "torqueConstant", "N.m/A"), None);
    }
}
