within Trueup.Effects.Load;
block BearingFriction "load-friction: bristles and viscous friction on the load side, Dahl's law (EF-21)"
  extends Interface;
  parameter Real loadFriction(unit = "N.m", min = 0) = 2.0 "Dry friction on the load side, tau_l (EF-21)";
  parameter Real loadViscousFriction(unit = "N.m.s/rad", min = 0) = 0.0 "Viscous friction on the load side, D_l (EF-21)";
  parameter Real loadFrictionDisplacement(unit = "rad", min = 0) = 1e-5 "Load angle over which the bristles yield, x_l (EF-21)";
  Real loadBristle(unit = "1") "Strain of the bristles, z (EF-21)";
initial equation
  loadBristle = 0.0;
equation
  der(loadBristle) = (velocity - noEvent(abs(velocity)) * loadBristle) / loadFrictionDisplacement;
  torque = -(loadFriction * loadBristle + loadViscousFriction * velocity);
end BearingFriction;
