within Trueup.Effects.Actuator;
block Push "external-force:actuator: up to three pushes on the command (EF-25)"
  extends Interface;
  parameter Real actuatorPushTorque(unit = "N.m") = 3e-4 "Size of the push (EF-25)";
  parameter Real actuatorPushStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real actuatorPushDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real actuatorPushEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real actuatorPushSecondTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real actuatorPushSecondStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real actuatorPushSecondDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real actuatorPushSecondEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real actuatorPushThirdTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real actuatorPushThirdStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real actuatorPushThirdDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real actuatorPushThirdEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  Parts.Pulse first(begin = actuatorPushStart, duration = actuatorPushDuration, edge = actuatorPushEdge);
  Parts.Pulse second(begin = actuatorPushSecondStart, duration = actuatorPushSecondDuration, edge = actuatorPushSecondEdge);
  Parts.Pulse third(begin = actuatorPushThirdStart, duration = actuatorPushThirdDuration, edge = actuatorPushThirdEdge);
equation
  torque = command + actuatorPushTorque * first.level + actuatorPushSecondTorque * second.level + actuatorPushThirdTorque * third.level;
end Push;
