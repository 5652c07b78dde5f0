within Trueup.Effects.Base;
block Appendage "appendage-mode: a body on a spring about the base's centre of mass; baseInertia is that of the stiff part (EF-24)"
  extends Interface;
  parameter Real appendageInertia(unit = "kg.m2", min = 0) = 0.5 "Moment of inertia of the appendage, J_a (EF-24)";
  parameter Real appendageFrequency(unit = "rad/s", min = 0) = 5.0 "Natural frequency with the base held, omega_a (EF-24)";
  parameter Real appendageDampingRatio(unit = "1", min = 0) = 0.02 "Share of critical damping, zeta (EF-24)";
  Real appendageAngle(unit = "rad") "Angle of the appendage, q_a (EF-24)";
  Real appendageRate(unit = "rad/s") "Rate of the appendage (EF-24)";
  Real acceleration(unit = "rad/s2") "Of the appendage";
initial equation
  appendageAngle = attitude;
  appendageRate = rate;
equation
  acceleration = -appendageFrequency ^ 2 * (appendageAngle - attitude)
    - 2 * appendageDampingRatio * appendageFrequency * (appendageRate - rate);
  der(appendageAngle) = appendageRate;
  der(appendageRate) = acceleration;
  torque = -appendageInertia * acceleration;
  kineticEnergy = appendageInertia * appendageRate ^ 2 / 2;
  potentialEnergy = appendageInertia * (appendageFrequency * (appendageAngle - attitude)) ^ 2 / 2;
  angularMomentum = appendageInertia * appendageRate;
  forceX = 0.0;
  forceY = 0.0;
  fieldX = 0.0;
  fieldY = 0.0;
end Appendage;
