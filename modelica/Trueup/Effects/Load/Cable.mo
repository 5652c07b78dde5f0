within Trueup.Effects.Load;
block Cable "cable-stiffness:load: a cable that pulls back (EF-22)"
  extends Interface;
  parameter Real cableStiffness(unit = "N.m/rad", min = 0) = 30.0 "Torque on the load per angle, k (EF-22)";
  parameter Real cableAngle(unit = "rad") = 0.0 "Load angle at which the cable does not pull, q_c (EF-22)";
equation
  torque = -cableStiffness * (angle - cableAngle);
end Cable;
