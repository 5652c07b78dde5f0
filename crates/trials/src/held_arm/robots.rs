//! Arms to draw from: six revolute joints, geometry and masses as their makers and papers give them.
//!
//! Facts (lengths, masses, centres of mass) of UR3, UR5 and UR10: Universal Robots, "DH parameters for calculations of
//! kinematics and dynamics" (support article 54030). Of the Panda: Franka Emika's control parameters (DH), and Gaz, Cognetti,
//! Oliva, Giordano, De Luca, "Dynamic identification of the Franka Emika Panda robot", IEEE RA-L 4(4), 2019, table of masses and
//! centres; its third joint is locked at 0 here. Axes by Craig's convention: each body's in its joint, z along it.

use super::space::Arrow;

/// A published arm.
pub(super) struct PublishedArm {
    pub(super) name: &'static str,
    /// Per joint: position in the carrier's axes (m), turn of its axes about x (quarter turns).
    pub(super) joints: [(Arrow, i8); 6],
    /// Per body: mass (kg), centre of mass (m).
    pub(super) bodies: [(f64, Arrow); 6],
    /// Of the flange, axes of the last body, m.
    pub(super) flange: Arrow,
    /// Dry (N.m) and viscous (N.m.s/rad) friction of a joint of the shoulder and one of the wrist, as usual for its drives.
    pub(super) friction: [(f64, f64); 2],
    /// Rotor of a joint of the shoulder and one of the wrist, joint side, kg.m2.
    pub(super) rotor: [f64; 2],
    /// Middle of the angles at which it works: least and most, rad.
    pub(super) posture: [(f64, f64); 6],
}

const QUARTERS: [i8; 6] = [0, 1, 0, 0, 1, -1];

/// Universal Robots' kind: lengths d1, a2, a3, d4, d5, d6 (m).
const fn universal(
    name: &'static str,
    [d1, a2, a3, d4, d5, d6]: [f64; 6],
    bodies: [(f64, Arrow); 6],
    friction: [(f64, f64); 2],
    rotor: [f64; 2],
) -> PublishedArm {
    PublishedArm {
        name,
        joints: [
            ([0.0, 0.0, d1], QUARTERS[0]),
            ([0.0, 0.0, 0.0], QUARTERS[1]),
            ([-a2, 0.0, 0.0], QUARTERS[2]),
            ([-a3, 0.0, d4], QUARTERS[3]),
            ([0.0, -d5, 0.0], QUARTERS[4]),
            ([0.0, d6, 0.0], QUARTERS[5]),
        ],
        bodies,
        flange: [0.0, 0.0, 0.0],
        friction,
        rotor,
        posture: [(-1.5, 1.5), (-2.3, -0.8), (-1.9, -0.5), (-2.2, -0.6), (-1.8, -0.9), (-1.5, 1.5)],
    }
}

pub(super) const PUBLISHED: [PublishedArm; 4] = [
    universal(
        "UR5",
        [0.089159, 0.425, 0.39225, 0.10915, 0.09465, 0.0823],
        [
            (3.7, [0.0, -0.00193, -0.02561]),
            (8.393, [-0.2125, 0.0, 0.11336]),
            (2.275, [-0.27232, 0.0, 0.0265]),
            (1.219, [0.0, -0.01634, -0.0018]),
            (1.219, [0.0, 0.01634, -0.0018]),
            (0.1879, [0.0, 0.0, -0.001159]),
        ],
        [(9.0, 12.0), (2.0, 2.0)],
        [1.1, 0.25],
    ),
    universal(
        "UR10",
        [0.1273, 0.612, 0.5723, 0.163941, 0.1157, 0.0922],
        [
            (7.1, [0.021, -0.027, 0.0]),
            (12.7, [-0.232, 0.0, 0.158]),
            (4.27, [-0.3323, 0.0, 0.068]),
            (2.0, [0.0, -0.018, 0.007]),
            (2.0, [0.0, 0.018, -0.007]),
            (0.365, [0.0, 0.0, -0.026]),
        ],
        [(14.0, 16.0), (2.5, 2.5)],
        [2.2, 0.35],
    ),
    universal(
        "UR3",
        [0.1519, 0.24365, 0.21325, 0.11235, 0.08535, 0.0819],
        [
            (2.0, [0.0, 0.0, -0.02]),
            (3.42, [-0.11365, 0.0, 0.1157]),
            (1.26, [-0.16325, 0.0, 0.0238]),
            (0.8, [0.0, -0.01, 0.0]),
            (0.8, [0.0, 0.01, 0.0]),
            (0.35, [0.0, 0.0, -0.02]),
        ],
        [(4.5, 5.0), (1.5, 1.2)],
        [0.45, 0.15],
    ),
    PublishedArm {
        name: "Panda",
        joints: [
            ([0.0, 0.0, 0.333], 0),
            ([0.0, 0.0, 0.0], -1),
            ([0.0825, -0.316, 0.0], 2),
            ([-0.0825, 0.384, 0.0], -1),
            ([0.0, 0.0, 0.0], 1),
            ([0.088, 0.0, 0.0], 1),
        ],
        bodies: [
            (4.970684, [0.003875, 0.002081, -0.175]),
            (3.87553, [0.0224, -0.2126, 0.0333]),
            (3.587895, [-0.05317, 0.104419, 0.027454]),
            (1.225946, [-0.011953, 0.041065, -0.038437]),
            (1.666555, [0.060149, -0.014117, -0.010517]),
            (0.735522, [0.010517, -0.004252, 0.061597]),
        ],
        flange: [0.0, 0.0, 0.107],
        friction: [(1.2, 1.0), (0.5, 0.4)],
        rotor: [0.6, 0.2],
        posture: [(-1.5, 1.5), (-0.8, 0.8), (-2.4, -0.9), (-1.5, 1.5), (1.2, 2.4), (-1.5, 1.5)],
    },
];
