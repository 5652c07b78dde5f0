within Trueup;
model TwoMassJointRigid "The joint declared rigid: one geared mass (TMJ-5)"
  extends Joint.Interface;
  constant Boolean jointFlexible = false "The joint has its spring; with it see TwoMassJoint";
equation
  loadAngle = motorAngle / gearRatio;
  loadVelocity = motorVelocity / gearRatio;
  loadAcceleration = motorAcceleration / gearRatio;
  friction.carried = motorTorque;
  modes.applied = motorTorque + (externalTorque + load.torque) / gearRatio;
  braked = motorInertia + loadInertia / gearRatio ^ 2; // (TMJ-5)
  transmissionTorque = (loadInertia * loadAcceleration - externalTorque - load.torque) / gearRatio;
end TwoMassJointRigid;
