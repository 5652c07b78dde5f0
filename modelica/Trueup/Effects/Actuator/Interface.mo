within Trueup.Effects.Actuator;
partial block Interface "Between the command and the motor"
  input Real command(unit = "N.m") "Torque asked of the motor";
  input Real angle(unit = "rad") "Of the motor's shaft";
  output Real torque(unit = "N.m") "Torque that the motor makes";
end Interface;
