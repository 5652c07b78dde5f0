within Trueup.Effects.MotorFriction;
block Asymmetric "asymmetric-friction: another friction forward than backward (EF-13)"
  extends Interface;
  parameter Real coulombAsymmetry(unit = "N.m") = 2e-5 "Half the difference of the dry friction, forward less backward, A_c (EF-13)";
  parameter Real viscousAsymmetry(unit = "N.m.s/rad") = 0.0 "Half the difference of the viscous friction, forward less backward, A_v (EF-13)";
protected
  Real forward(unit = "N.m") = (viscousFriction + viscousAsymmetry) * velocity;
  Real backward(unit = "N.m") = (viscousAsymmetry - viscousFriction) * velocity;
equation
  // No level falls below 0, and what brakes with the speed does not drive.
  breakawayForward = noEvent(max(static + coulombAsymmetry, 0.0));
  breakawayBackward = noEvent(max(static - coulombAsymmetry, 0.0));
  brakingForward = noEvent(max(coulombFriction + coulombAsymmetry, 0.0)) + noEvent(if velocity > 0 then max(forward, 0.0) else forward);
  brakingBackward = noEvent(max(coulombFriction - coulombAsymmetry, 0.0)) + noEvent(if velocity < 0 then max(backward, 0.0) else backward);
  dry = static + noEvent(abs(coulombAsymmetry));
end Asymmetric;
