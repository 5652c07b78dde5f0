within Trueup.Effects.Base;
block Thrust "base-thrust: a force and a torque, steady in the satellite's axes (EF-23)"
  extends Wrench;
  parameter Real thrustForceX(unit = "N") = 0.05 "Force along the satellite's x axis, F_x (EF-23)";
  parameter Real thrustForceY(unit = "N") = 0.0 "Force along the satellite's y axis, F_y (EF-23)";
  parameter Real thrustTorque(unit = "N.m") = 0.01 "Torque on the satellite, T (EF-23)";
equation
  forceX = cos(attitude) * thrustForceX - sin(attitude) * thrustForceY;
  forceY = sin(attitude) * thrustForceX + cos(attitude) * thrustForceY;
  torque = thrustTorque;
  potentialEnergy = 0.0;
end Thrust;
