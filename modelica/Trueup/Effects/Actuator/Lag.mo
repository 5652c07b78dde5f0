within Trueup.Effects.Actuator;
block Lag "actuator-lag: T dtau/dt = u(t - d) - tau (EF-11)"
  extends Interface;
  parameter Real actuatorLag(unit = "s", min = 0, max = 5) = 0.005 "Time constant of the lag, T (EF-11)";
  parameter Real actuatorDelay(unit = "s", min = 0, max = 0.5) = 0.0 "Dead time, d (EF-11)";
  Real laggedTorque(unit = "N.m") "Torque behind the lag (EF-11)";
  Parts.Memory memory(delay = actuatorDelay);
protected
  parameter Real filter(unit = "s") = sqrt(actuatorLag ^ 2 + 1e-3 ^ 2) "W of (1 + s (W - T))/(1 + s W)";
initial equation
  // Nothing was asked for before the start, as in the FMU.
  laggedTorque = 0.0;
equation
  memory.signal = command;
  memory.before = 0.0;
  filter * der(laggedTorque) = memory.delayed - laggedTorque;
  torque = memory.delayed - (memory.delayed - laggedTorque) * actuatorLag / filter;
end Lag;
