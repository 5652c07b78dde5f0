within Trueup.Effects.MotorFriction;
block Presliding "presliding-friction: bristles that yield before sliding, Dahl's law (EF-17)"
  extends Interface;
  parameter Real preslidingShare(unit = "1", min = 0, max = 1) = 1.0 "Share of the dry friction that bristles carry, s (EF-17)";
  parameter Real preslidingDisplacement(unit = "rad", min = 0) = 0.5 "Motor angle over which the bristles yield, x_p (EF-17)";
  Real bristle(unit = "1") "Strain of the bristles, z (EF-17)";
protected
  Real strained(unit = "N.m") = preslidingShare * coulombFriction * bristle;
initial equation
  bristle = 0.0;
equation
  der(bristle) = (velocity - noEvent(abs(velocity)) * bristle) / preslidingDisplacement;
  breakawayForward = (1 - preslidingShare) * static + strained;
  breakawayBackward = (1 - preslidingShare) * static - strained;
  brakingForward = (1 - preslidingShare) * coulombFriction + strained + viscousFriction * velocity;
  brakingBackward = (1 - preslidingShare) * coulombFriction - strained - viscousFriction * velocity;
  dry = static;
end Presliding;
