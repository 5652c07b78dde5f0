within Trueup.Effects.Sensor;
block Drift "sensor-drift: an offset that moves (EF-32); units are those of a reading in rad"
  extends Interface;
  parameter Real driftRate(unit = "rad/s") = 0.01 "Rate of the offset where it begins to move, r (EF-32)";
  parameter Real driftTime(unit = "s", min = 0) = 10.0 "Time in which the offset settles, T (EF-32)";
  parameter Real driftStart(unit = "s", min = 0) = 0.0 "When the offset begins to move, t_0 (EF-32)";
equation
  reading = actual + driftRate * driftTime * (1 - exp(-noEvent(max(time - driftStart, 0.0)) / driftTime));
end Drift;
