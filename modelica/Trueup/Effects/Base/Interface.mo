within Trueup.Effects.Base;
partial block Interface "At the base's centre of mass, inertial frame"
  input Real positionX(unit = "m") "Of the base's centre of mass";
  input Real positionY(unit = "m");
  input Real attitude(unit = "rad") "Of the base";
  input Real velocityX(unit = "m/s");
  input Real velocityY(unit = "m/s");
  input Real rate(unit = "rad/s");
  output Real forceX(unit = "N") "On the base";
  output Real forceY(unit = "N");
  output Real torque(unit = "N.m") "On the base";
  output Real fieldX(unit = "m/s2") "Acceleration that pulls at all bodies";
  output Real fieldY(unit = "m/s2");
  output Real kineticEnergy(unit = "J") "Of the effect itself";
  output Real potentialEnergy(unit = "J") "That it stores";
  output Real angularMomentum(unit = "kg.m2/s") "Of the effect itself";
end Interface;
