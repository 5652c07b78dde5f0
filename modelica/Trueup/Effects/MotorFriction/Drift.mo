within Trueup.Effects.MotorFriction;
block Drift "friction-drift: all friction times 1 + r T (1 - exp(-t/T)) (EF-16)"
  extends Interface;
  parameter Real frictionDriftRate(unit = "1/s") = -0.2 "Relative rate of all friction at the start, r (EF-16)";
  parameter Real frictionDriftTime(unit = "s", min = 0) = 2.0 "Time in which friction settles, T (EF-16)";
protected
  Real factor(unit = "1") = noEvent(max(1 + frictionDriftRate * frictionDriftTime * (1 - exp(-time / frictionDriftTime)), 0.0));
equation
  breakawayForward = factor * static;
  breakawayBackward = factor * static;
  brakingForward = factor * (coulombFriction + viscousFriction * velocity);
  brakingBackward = factor * (coulombFriction - viscousFriction * velocity);
  dry = static;
end Drift;
