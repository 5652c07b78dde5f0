within Trueup.Effects.Load;
partial block Interface "On the load, beside externalTorque"
  input Real angle(unit = "rad") "Of the load";
  input Real velocity(unit = "rad/s") "Of the load";
  output Real torque(unit = "N.m") "Drives the load forward";
end Interface;
