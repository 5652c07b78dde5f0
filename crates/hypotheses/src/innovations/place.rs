//! Places of laws on a plant, with their units and usual sizes.

/// How far a plant moves within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionInStep {
    /// Little: transmissions and links are straight between nodes, and their laws are means of the values at both ends.
    Straight,
    /// Much: angles are cubic between nodes, speeds straight, and laws are means over the parts of a step.
    Curved,
}

/// A joint of a plant: places and usual sizes of its laws. Angles of motor and link are on the same side of the gear.
#[derive(Clone, Debug, PartialEq)]
pub struct JointPlace {
    /// Coordinate of the motor; of a rigid joint of a chain that of the link.
    pub motor: usize,
    /// Coordinate of the link.
    pub link: usize,
    /// Usual torque of the drive, N.m: the unit of torques.
    pub torque: f64,
    /// Unit of angle of errors of the gear, rad.
    pub gear_error: f64,
    /// Stiffness in hand, N.m/rad; 0: rigid.
    pub stiffness: f64,
    /// The parameter that it is.
    pub stiffness_name: &'static str,
    /// Damping in hand, N.m.s/rad.
    pub damping: f64,
    /// Least damping that a law of damping takes as usual, N.m.s/rad.
    pub least_damping: f64,
    /// Inertia in hand of a link that is alone behind its joint, on its own side, kg.m2; 0: it is in a chain.
    pub link_inertia: f64,
    /// Turns of the link's coordinate per turn of the link.
    pub turns: f64,
    /// Turns of the rotor per turn of the motor's coordinate.
    pub rotor_turns: f64,
    /// Level of dry friction that the nominal plant has at the motor, in hand, N.m; 0: none.
    pub dry: f64,
    /// Its viscous friction, N.m.s/rad.
    pub viscous: f64,
    /// Resolution of the encoder of the motor (where it has none, of the link), rad.
    pub resolution: f64,
    /// Whether the motor is read.
    pub motor_read: bool,
    /// Largest drive: in the unit of the recorded input.
    pub drive: f64,
    /// Usual speed of the motor, rad/s.
    pub motor_speed: f64,
    /// Usual speed of the link, rad/s.
    pub link_speed: f64,
    /// Usual twist, rad.
    pub twist: f64,
    /// Usual rate of twist, rad/s.
    pub twist_rate: f64,
    /// Range of the motor's angle, rad.
    pub range: f64,
    /// Middle of the link's angle and its farthest distance from there, rad.
    pub reach: [f64; 2],
}

/// What a channel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShownBy {
    /// Position of a coordinate.
    Position(usize),
    /// Rate of a coordinate.
    Rate(usize),
    /// Place of the tip along x, y or its attitude.
    Tip(usize),
    /// Another output of the model, such as a rate of the tip.
    Output,
}

/// A channel as a place of laws.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelPlace {
    /// Place of laws about it: `sensor:` with its name, or `sensor`.
    pub place: &'static str,
    /// What it shows.
    pub shows: ShownBy,
    /// Unit of its errors.
    pub error: f64,
    /// Turns of the coordinate per turn of the disc that is read.
    pub turns: f64,
    /// Whether what is wrong with it shows in the other readings.
    pub compared: bool,
}

/// A free base: x, y in m and attitude in rad, in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct BasePlace {
    /// Its coordinates.
    pub coordinates: [usize; 3],
    /// Usual forces, N and N.m.
    pub force: [f64; 3],
    /// Usual rates.
    pub speed: [f64; 3],
    /// Middles of its places.
    pub middle: [f64; 3],
    /// Half their ranges.
    pub reach: [f64; 3],
    /// Mass in hand, kg.
    pub mass: f64,
    /// Inertia in hand, kg.m2.
    pub inertia: f64,
}
