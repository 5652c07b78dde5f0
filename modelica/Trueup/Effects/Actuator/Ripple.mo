within Trueup.Effects.Actuator;
block Ripple "torque-ripple: torque that repeats with the angle of the shaft (EF-12)"
  extends Interface;
  parameter Real rippleSine(unit = "N.m") = 2e-5 "Torque that goes with the sine of the shaft's angle, T_s (EF-12)";
  parameter Real rippleCosine(unit = "N.m") = 0.0 "Torque that goes with the cosine of the shaft's angle, T_c (EF-12)";
  parameter Real rippleOrder(unit = "1", min = 0) = 4.0 "Periods per turn of the shaft, k (EF-12)";
  parameter Real rippleSine2(unit = "N.m") = 0.0 "Torque that goes with the sine of the double order, T_s2 (EF-12)";
  parameter Real rippleCosine2(unit = "N.m") = 0.0 "Torque that goes with the cosine of the double order, T_c2 (EF-12)";
equation
  torque = command + rippleSine * sin(rippleOrder * angle) + rippleCosine * cos(rippleOrder * angle)
    + rippleSine2 * sin(2 * rippleOrder * angle) + rippleCosine2 * cos(2 * rippleOrder * angle);
end Ripple;
