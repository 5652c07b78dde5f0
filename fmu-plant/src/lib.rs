//! TwoMassJoint and PlanarManipulator as FMUs: binding only.
