within Trueup.Effects.MotorFriction;
block Stribeck "stribeck-friction: from the break-away level down to the Coulomb level with speed (EF-2)"
  extends Interface;
  parameter Real stribeckVelocity(unit = "rad/s", min = 0) = 20.0
    "Motor speed at which the excess of break-away over Coulomb friction has fallen to 1/e, omega_s (EF-2)";
protected
  Real sliding(unit = "N.m") = coulombFriction + (static - coulombFriction) * exp(-noEvent(abs(velocity)) / stribeckVelocity);
equation
  breakawayForward = static;
  breakawayBackward = static;
  brakingForward = sliding + viscousFriction * velocity;
  brakingBackward = sliding - viscousFriction * velocity;
  dry = static;
end Stribeck;
