within Trueup.Effects.Base;
block TableTilt "table-tilt: a table that is not level (EF-8)"
  extends Interface;
  parameter Real tiltAccelerationX(unit = "m/s2") = 0.002 "Gravity in the table's plane along inertial x, a_x (EF-8); 1 mrad of tilt makes 0.0098";
  parameter Real tiltAccelerationY(unit = "m/s2") = 0.0 "The same along inertial y, a_y (EF-8)";
equation
  fieldX = tiltAccelerationX;
  fieldY = tiltAccelerationY;
  forceX = 0.0;
  forceY = 0.0;
  torque = 0.0;
  kineticEnergy = 0.0;
  potentialEnergy = 0.0;
  angularMomentum = 0.0;
end TableTilt;
