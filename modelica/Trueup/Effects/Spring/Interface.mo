within Trueup.Effects.Spring;
partial block Interface "From deflection to torque"
  input Real stiffness(unit = "N.m/rad") "K_eq";
  input Real damping(unit = "N.m.s/rad") "D_eq";
  input Real deflection(unit = "rad") "What the spring is stretched by";
  input Real rate(unit = "rad/s") "Of the deflection";
  output Real torque(unit = "N.m") "On the load, and against the motor";
end Interface;
