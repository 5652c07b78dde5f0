within Trueup.Effects.MotorFriction;
partial block Interface "Magnitudes of the friction torque in either direction"
  input Real coulombFriction(unit = "N.m") "tau_c";
  input Real staticFriction(unit = "N.m") "tau_s";
  input Real viscousFriction(unit = "N.m.s/rad") "D_m";
  input Real velocity(unit = "rad/s") "Of the motor";
  input Real carried(unit = "N.m") "Torque of the transmission";
  output Real breakawayForward(unit = "N.m") "Up to this much a motor that is driven forward sticks";
  output Real breakawayBackward(unit = "N.m") "The same backward";
  output Real brakingForward(unit = "N.m") "What brakes a motor that slides forward";
  output Real brakingBackward(unit = "N.m") "The same backward";
  output Real dry "Above 0: there is dry friction at all";
protected
  Real static(unit = "N.m") = noEvent(max(staticFriction, coulombFriction)) "Break-away is never below the Coulomb level";
end Interface;
