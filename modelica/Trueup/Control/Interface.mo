within Trueup.Control;
partial block Interface "Parameters, inputs and output of a joint's controller"
  extends Waves;
  parameter Real positionGain(unit = "1/s", min = 0) = 2.5 "Position gain K_p: velocity reference v = K_p (r - theta1) in P_PI; see strategy";
  parameter Real velocityGain(unit = "N.m.s/rad", min = 0) = 14155.45632
    "Velocity gain K_vp, load-referred: tau = K_vp (v - theta0') + K_vi integral of (v - theta0')";
  parameter Real velocityIntegralTime(unit = "s", min = 0) = 0.1
    "Integral time T_i of the velocity loop, also the tracking time at the limit: K_vi = K_vp/T_i";
  parameter Real gearRatio(unit = "1", min = 0) = 44340.0 "Gear ratio n: theta0 = motorAngle/n, motor torque = tau/n";
  parameter Real torqueConstant(unit = "N.m/A", min = 0) = 0.02 "Torque constant K_t of the motor: motorCurrent = tau/(n K_t)";
  parameter Real currentLimit(unit = "A", min = 0) = 0.25 "Limit of the magnitude of motorCurrent; the integral does not wind up at it";
  parameter Real washoutFrequency(unit = "rad/s", min = 0) = 1.0 "omega_h of VWBC_WASHOUT: below it the waves give way to P_PI";
  parameter Strategy strategy = Strategy.P_PI "What makes the velocity reference v";
  input Real positionReference(unit = "rad") "Reference r of the angle on the load side";
  input Real velocityFeedforward(unit = "rad/s") "Added to the velocity reference v, load side";
  input Real motorAngle(unit = "rad") "Angle of the motor, n theta0";
  input Real motorVelocity(unit = "rad/s") "Velocity of the motor, n theta0'";
  input Real loadAngle(unit = "rad") "Angle theta1 on the load side of the joint";
  input Real loadVelocity(unit = "rad/s") "Velocity theta1' on the load side of the joint";
  output Real motorCurrent(unit = "A") "Command to the motor, motorCurrent = tau/(n K_t) within its limit";
end Interface;
