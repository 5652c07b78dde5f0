within Trueup.Effects.Load;
block Gravity "gravity-torque: an unbalanced load, or an axis that is not vertical (EF-7)"
  extends Interface;
  parameter Real gravityTorque(unit = "N.m", min = 0) = 5.0 "Largest gravity torque on the load, tau_g (EF-7)";
  parameter Real gravityAngle(unit = "rad") = -1.5707963267948966 "Load angle at which it hangs at rest, q_g (EF-7)";
equation
  torque = -gravityTorque * sin(angle - gravityAngle);
end Gravity;
