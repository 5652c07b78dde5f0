within Trueup.Effects.MotorFriction;
block NonlinearViscous "nonlinear-viscous-friction: tau_d (|omega|/omega_d)^p against the motion (EF-15)"
  extends Interface;
  parameter Real dragTorque(unit = "N.m", min = 0) = 5e-5 "Friction torque at the reference speed, tau_d (EF-15)";
  parameter Real dragExponent(unit = "1", min = 0.3, max = 4) = 2.0 "Exponent of the speed, p (EF-15); 1 is viscous friction";
  parameter Real dragReferenceSpeed(unit = "rad/s", min = 0) = 1000.0 "Speed at which the friction is tau_d, omega_d (EF-15)";
protected
  Real share(unit = "1") = velocity / dragReferenceSpeed;
  // Straight below a hundredth of the reference.
  Real drag(unit = "N.m") = viscousFriction * velocity + dragTorque * share * (share ^ 2 + 0.01 ^ 2) ^ ((dragExponent - 1) / 2);
equation
  breakawayForward = static;
  breakawayBackward = static;
  brakingForward = coulombFriction + drag;
  brakingBackward = coulombFriction - drag;
  dry = static;
end NonlinearViscous;
