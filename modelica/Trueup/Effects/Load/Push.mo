within Trueup.Effects.Load;
block Push "external-force:load: up to three pushes on the load (EF-25)"
  extends Interface;
  parameter Real loadPushTorque(unit = "N.m") = 5.0 "Size of the push (EF-25)";
  parameter Real loadPushStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real loadPushDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real loadPushEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real loadPushSecondTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real loadPushSecondStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real loadPushSecondDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real loadPushSecondEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real loadPushThirdTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real loadPushThirdStart(unit = "s") = 0.3 "When the push begins, t_0 (EF-25)";
  parameter Real loadPushThirdDuration(unit = "s", min = 0) = 0.2 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real loadPushThirdEdge(unit = "s", min = 0) = 0.01 "Length of an edge, r (EF-25); 0: sharp";
  Parts.Pulse first(begin = loadPushStart, duration = loadPushDuration, edge = loadPushEdge);
  Parts.Pulse second(begin = loadPushSecondStart, duration = loadPushSecondDuration, edge = loadPushSecondEdge);
  Parts.Pulse third(begin = loadPushThirdStart, duration = loadPushThirdDuration, edge = loadPushThirdEdge);
equation
  torque = loadPushTorque * first.level + loadPushSecondTorque * second.level + loadPushThirdTorque * third.level;
end Push;
