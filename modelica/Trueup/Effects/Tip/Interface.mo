within Trueup.Effects.Tip;
partial block Interface "On the last link at its tip, beside tipForce and tipTorque"
  output Real forceX(unit = "N") "Inertial frame";
  output Real forceY(unit = "N");
  output Real torque(unit = "N.m");
end Interface;
