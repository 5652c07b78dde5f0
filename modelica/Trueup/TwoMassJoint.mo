within Trueup;
model TwoMassJoint "Two-mass flexible joint with stick-slip friction (Comi et al., DELIAN, section 3.2)"
  extends Joint.Interface;
  constant Boolean jointFlexible = true "The joint has its spring; without it see TwoMassJointRigid";
  Real twist(unit = "rad") "epsilon = q_m - n q_l, a state: formed from two angles of thousands of rad it would have lost its digits";
  replaceable Effects.Gear.Exact gear constrainedby Effects.Gear.Interface;
  replaceable Effects.Spring.Linear spring constrainedby Effects.Spring.Interface;
initial equation
  twist = initialMotorAngle - gearRatio * initialLoadAngle;
  loadVelocity = initialLoadVelocity;
equation
  gear.angle = motorAngle;
  gear.velocity = motorVelocity;
  spring.stiffness = stiffness;
  spring.damping = damping;
  spring.deflection = twist - gear.error;
  spring.rate = der(twist) - gear.slope * motorVelocity;
  transmissionTorque = spring.torque; // (TMJ-2)
  friction.carried = transmissionTorque;
  modes.applied = motorTorque - transmissionTorque * (1 - gear.slope);
  braked = motorInertia; // (TMJ-1)
  der(twist) = motorVelocity - gearRatio * loadVelocity;
  loadAcceleration = (gearRatio * transmissionTorque + externalTorque + load.torque) / loadInertia; // (TMJ-3)
  der(loadVelocity) = loadAcceleration;
  loadAngle = (motorAngle - twist) / gearRatio;
end TwoMassJoint;
