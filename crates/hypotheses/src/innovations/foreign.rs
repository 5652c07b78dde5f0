//! A joint that is an FMU of others as the plant of a search, and effects as forces between its ports.

pub use trueup_estimation::innovations::foreign::{BREAKAWAY, ForeignJoint, ForeignJointError, JointRoles};
pub use trueup_estimation::innovations::known_effects::{KnownEffects, KnownPoint, UnfitEffect};
pub use trueup_estimation::innovations::plant::{BelievedParameter, ForcedPlant, JointFigures};
