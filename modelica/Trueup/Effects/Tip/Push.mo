within Trueup.Effects.Tip;
block Push "external-force:tip: up to three pushes on the tip (EF-25)"
  extends Interface;
  parameter Real tipPushForceX(unit = "N") = 0.5 "Size of the push (EF-25)";
  parameter Real tipPushForceY(unit = "N") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushStart(unit = "s") = 1.0 "When the push begins, t_0 (EF-25)";
  parameter Real tipPushDuration(unit = "s", min = 0) = 1.0 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real tipPushEdge(unit = "s", min = 0) = 0.05 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real tipPushSecondForceX(unit = "N") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushSecondForceY(unit = "N") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushSecondTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushSecondStart(unit = "s") = 1.0 "When the push begins, t_0 (EF-25)";
  parameter Real tipPushSecondDuration(unit = "s", min = 0) = 1.0 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real tipPushSecondEdge(unit = "s", min = 0) = 0.05 "Length of an edge, r (EF-25); 0: sharp";
  parameter Real tipPushThirdForceX(unit = "N") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushThirdForceY(unit = "N") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushThirdTorque(unit = "N.m") = 0.0 "Size of the push (EF-25)";
  parameter Real tipPushThirdStart(unit = "s") = 1.0 "When the push begins, t_0 (EF-25)";
  parameter Real tipPushThirdDuration(unit = "s", min = 0) = 1.0 "From the begin of the first edge to that of the second, d (EF-25)";
  parameter Real tipPushThirdEdge(unit = "s", min = 0) = 0.05 "Length of an edge, r (EF-25); 0: sharp";
  Parts.Pulse first(begin = tipPushStart, duration = tipPushDuration, edge = tipPushEdge);
  Parts.Pulse second(begin = tipPushSecondStart, duration = tipPushSecondDuration, edge = tipPushSecondEdge);
  Parts.Pulse third(begin = tipPushThirdStart, duration = tipPushThirdDuration, edge = tipPushThirdEdge);
equation
  forceX = tipPushForceX * first.level + tipPushSecondForceX * second.level + tipPushThirdForceX * third.level;
  forceY = tipPushForceY * first.level + tipPushSecondForceY * second.level + tipPushThirdForceY * third.level;
  torque = tipPushTorque * first.level + tipPushSecondTorque * second.level + tipPushThirdTorque * third.level;
end Push;
