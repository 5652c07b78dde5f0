//! The coordinates of a plant: what moves, what shows it, and where a force on it acts.

/// What moves along a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateKind {
    /// A motor's rotor; of a rigid joint the joint with its rotor.
    Motor,
    /// A body behind a motor.
    Link,
    /// A body that nothing drives.
    Base,
}

/// A coordinate that another one stays close to, behind a spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Follows {
    /// The other coordinate, by index.
    pub coordinate: usize,
    /// Parameter by which the other one is larger; none: they are alike.
    pub ratio: Option<usize>,
}

/// One coordinate of a plant, by indices. A generalised force along it does positive work as the coordinate grows.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinate {
    /// Its name in reports.
    pub name: String,
    /// What moves along it.
    pub kind: CoordinateKind,
    /// Unit of a generalised force along it: `N.m` or `N`.
    pub force_unit: &'static str,
    /// State: its position. None: another state gives it (a twist).
    pub position: Option<usize>,
    /// State: its rate.
    pub rate: usize,
    /// Parameter: its position at the start.
    pub initial_position: usize,
    /// Parameter: its rate at the start.
    pub initial_rate: usize,
    /// Output that shows its position.
    pub position_output: usize,
    /// Output that shows its rate.
    pub rate_output: usize,
    /// Mode of its dry friction: whether it sticks; none: it has no dry friction.
    pub friction_mode: Option<usize>,
    /// Parameters that are the levels of its dry friction: sliding, break-away.
    pub dry_friction: Option<[usize; 2]>,
    /// The coordinate that it hangs on by a spring.
    pub follows: Option<Follows>,
}
