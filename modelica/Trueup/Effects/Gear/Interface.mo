within Trueup.Effects.Gear;
partial block Interface "What the gear takes from the deflection"
  input Real angle(unit = "rad") "Of the motor's shaft";
  input Real velocity(unit = "rad/s") "Of the motor's shaft";
  output Real error(unit = "rad") "Less than the twist the spring is stretched by this";
  output Real slope(unit = "1") "Change of the error with the angle: the motor feels 1 - slope times the spring's torque";
end Interface;
