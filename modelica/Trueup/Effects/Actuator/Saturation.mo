within Trueup.Effects.Actuator;
block Saturation "current-saturation: T / (1 + (|T|/L)^p)^(1/p) (EF-10)"
  extends Interface;
  parameter Real saturationTorque(unit = "N.m", min = 0) = 2.5e-4 "Torque of the motor at the amplifier's limit, L (EF-10)";
  parameter Real saturationSharpness(unit = "1", min = 2, max = 60) = 8.0 "Exponent of the knee, p (EF-10)";
protected
  Real load(unit = "1") "Share of the limit";
equation
  load = noEvent(abs(command)) / saturationTorque;
  // Above the limit by the inverse, so that a large power does not overflow.
  torque = if noEvent(load <= 1) then command * (1 + load ^ saturationSharpness) ^ (-1 / saturationSharpness)
    else command / load * (1 + (1 / load) ^ saturationSharpness) ^ (-1 / saturationSharpness);
end Saturation;
