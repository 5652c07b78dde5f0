within Trueup.Effects.MotorFriction;
block Drift "friction-drift: all friction times 1 + r T (1 - exp(-(t + t_0)/T)) (EF-16)"
  extends Interface;
  parameter Real frictionDriftRate(unit = "1/s") = -0.2 "Relative rate of all friction at the start, r (EF-16)";
  parameter Real frictionDriftTime(unit = "s", min = 0) = 2.0 "Time in which friction settles, T (EF-16)";
  parameter Real initialFrictionDriftTime(unit = "s", min = 0) = 0.0 "How long friction has been changing when a run begins, t_0 (EF-16)";
protected
  Real factor(unit = "1") = noEvent(max(1 + frictionDriftRate * frictionDriftTime * (1 - exp(-(time + initialFrictionDriftTime) / frictionDriftTime)), 0.0));
equation
  breakawayForward = factor * static;
  breakawayBackward = factor * static;
  brakingForward = factor * (coulombFriction + viscousFriction * velocity);
  brakingBackward = factor * (coulombFriction - viscousFriction * velocity);
  dry = static;
end Drift;
