//! The units that the models use, as FMI writes them.

/// A unit by its exponents of the SI base units (and rad); all factors are 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SiUnit {
    /// Name as used by a variable.
    pub name: &'static str,
    /// Exponent of kg.
    pub kg: i32,
    /// Exponent of m.
    pub m: i32,
    /// Exponent of s.
    pub s: i32,
    /// Exponent of A.
    pub a: i32,
    /// Exponent of rad.
    pub rad: i32,
}

const fn unit(name: &'static str, kg: i32, m: i32, s: i32, a: i32, rad: i32) -> SiUnit {
    SiUnit { name, kg, m, s, a, rad }
}

/// All units. N.m per rad is written as such: a rotational stiffness is not an energy.
pub const UNITS: &[SiUnit] = &[
    unit("1", 0, 0, 0, 0, 0),
    unit("s", 0, 0, 1, 0, 0),
    unit("1/s", 0, 0, -1, 0, 0),
    unit("1/s2", 0, 0, -2, 0, 0),
    unit("1/s3", 0, 0, -3, 0, 0),
    unit("m", 0, 1, 0, 0, 0),
    unit("m/s", 0, 1, -1, 0, 0),
    unit("m/s2", 0, 1, -2, 0, 0),
    unit("rad", 0, 0, 0, 0, 1),
    unit("rad/s", 0, 0, -1, 0, 1),
    unit("rad/s2", 0, 0, -2, 0, 1),
    unit("rad/s3", 0, 0, -3, 0, 1),
    unit("m4", 0, 4, 0, 0, 0),
    unit("kg", 1, 0, 0, 0, 0),
    unit("kg/m", 1, -1, 0, 0, 0),
    unit("kg.m", 1, 1, 0, 0, 0),
    unit("kg.m2", 1, 2, 0, 0, 0),
    unit("kg.m/s", 1, 1, -1, 0, 0),
    unit("kg.m2/s", 1, 2, -1, 0, 0),
    unit("N", 1, 1, -2, 0, 0),
    unit("N/m", 1, 0, -2, 0, 0),
    unit("N.s/m", 1, 0, -1, 0, 0),
    unit("N.m", 1, 2, -2, 0, 0),
    unit("N.m2", 1, 3, -2, 0, 0),
    unit("N.m/s", 1, 2, -3, 0, 0),
    unit("N.s", 1, 1, -1, 0, 0),
    unit("N/s", 1, 1, -3, 0, 0),
    unit("kg/s", 1, 0, -1, 0, 0),
    unit("1/(kg.m2.s)", -1, -2, -1, 0, 0),
    unit("N.m/rad", 1, 2, -2, 0, -1),
    unit("N.m/rad3", 1, 2, -2, 0, -3),
    unit("N.m.s", 1, 2, -1, 0, 0),
    unit("N.m.s/rad", 1, 2, -1, 0, -1),
    unit("Pa", 1, -1, -2, 0, 0),
    unit("J", 1, 2, -2, 0, 0),
    unit("A", 0, 0, 0, 1, 0),
    unit("A/s", 0, 0, -1, 1, 0),
    unit("N.m/A", 1, 2, -2, -1, 0),
];

/// The unit of that name.
pub fn find(name: &str) -> Option<SiUnit> {
    UNITS.iter().copied().find(|u| u.name == name)
}
