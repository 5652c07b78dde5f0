within Trueup.Effects.Spring;
block Hysteresis "transmission-hysteresis: friction inside the compliant element, Dahl's law (EF-5)"
  extends Interface;
  parameter Real hysteresisTorque(unit = "N.m", min = 0) = 1e-5 "Half width of the loop, tau_h (EF-5)";
  parameter Real hysteresisDisplacement(unit = "rad", min = 0) = 0.5 "Deflection over which the loop closes after a reversal, x_h (EF-5)";
  Real hysteresis(unit = "1") "Share of the hysteresis torque, z (EF-5)";
initial equation
  hysteresis = 0.0;
equation
  der(hysteresis) = (rate - noEvent(abs(rate)) * hysteresis) / hysteresisDisplacement;
  torque = stiffness * deflection + damping * rate + hysteresisTorque * hysteresis;
end Hysteresis;
