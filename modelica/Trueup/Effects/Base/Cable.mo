within Trueup.Effects.Base;
block Cable "cable-stiffness:base: an umbilical that pulls back (EF-22)"
  extends Wrench;
  parameter Real cableStiffness(unit = "N/m", min = 0) = 2.0 "Force on the base per displacement, k (EF-22)";
  parameter Real cableRotationalStiffness(unit = "N.m/rad", min = 0) = 0.5 "Torque on the base per angle, k_r (EF-22)";
  parameter Real cablePositionX(unit = "m") = 0.0 "Inertial x of the base at which the cable does not pull (EF-22)";
  parameter Real cablePositionY(unit = "m") = 0.0 "The same along inertial y (EF-22)";
  parameter Real cableAttitude(unit = "rad") = 0.0 "Attitude of the base at which the cable does not turn it, q_c (EF-22)";
equation
  forceX = -cableStiffness * (positionX - cablePositionX);
  forceY = -cableStiffness * (positionY - cablePositionY);
  torque = -cableRotationalStiffness * (attitude - cableAttitude);
  potentialEnergy = (cableStiffness * ((positionX - cablePositionX) ^ 2 + (positionY - cablePositionY) ^ 2)
    + cableRotationalStiffness * (attitude - cableAttitude) ^ 2) / 2;
end Cable;
