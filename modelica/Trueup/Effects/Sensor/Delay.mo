within Trueup.Effects.Sensor;
block Delay "sensor-delay: one channel late against the others (EF-30)"
  extends Interface;
  parameter Real delay(unit = "s", min = 0, max = 0.5) = 0.01 "How late the channel is, d (EF-30)";
  Parts.Memory memory(delay = delay);
equation
  memory.signal = actual;
  memory.before = actual; // it stood still
  reading = memory.delayed;
end Delay;
