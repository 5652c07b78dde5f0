within Trueup.Effects.MotorFriction;
block LoadDependent "load-dependent-friction: mu |tau| more of all dry friction (EF-14)"
  extends Interface;
  parameter Real loadFrictionCoefficient(unit = "1", min = 0, max = 1) = 0.2 "Friction torque per torque carried, mu (EF-14)";
protected
  Real more(unit = "N.m") = loadFrictionCoefficient * noEvent(abs(carried));
equation
  breakawayForward = static + more;
  breakawayBackward = static + more;
  brakingForward = coulombFriction + more + viscousFriction * velocity;
  brakingBackward = coulombFriction + more - viscousFriction * velocity;
  dry = static + loadFrictionCoefficient;
end LoadDependent;
