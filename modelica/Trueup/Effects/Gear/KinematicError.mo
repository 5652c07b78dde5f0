within Trueup.Effects.Gear;
block KinematicError "kinematic-error: a gear error that repeats with the angle of the shaft (EF-19)"
  extends Interface;
  parameter Real kinematicErrorSine(unit = "rad") = 0.5 "Gear error that goes with the sine, on the drive's side, e_s (EF-19)";
  parameter Real kinematicErrorCosine(unit = "rad") = 0.0 "Gear error that goes with the cosine, on the drive's side, e_c (EF-19)";
  parameter Real kinematicErrorOrder(unit = "1", min = 0) = 0.005 "Periods per turn of the motor's shaft, k (EF-19)";
  parameter Real kinematicErrorSine2(unit = "rad") = 0.0 "Gear error that goes with the sine of the double order, e_s2 (EF-19)";
  parameter Real kinematicErrorCosine2(unit = "rad") = 0.0 "Gear error that goes with the cosine of the double order, e_c2 (EF-19)";
protected
  Real turned = kinematicErrorOrder * angle;
equation
  error = kinematicErrorSine * sin(turned) + kinematicErrorCosine * cos(turned)
    + kinematicErrorSine2 * sin(2 * turned) + kinematicErrorCosine2 * cos(2 * turned);
  slope = kinematicErrorOrder * (kinematicErrorSine * cos(turned) - kinematicErrorCosine * sin(turned)
    + 2 * (kinematicErrorSine2 * cos(2 * turned) - kinematicErrorCosine2 * sin(2 * turned)));
end KinematicError;
