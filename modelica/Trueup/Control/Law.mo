within Trueup.Control;
partial block Law "The torque that a strategy asks for, from the waves and the integral (load-referred)"
  extends Interface;
  Schedule schedule(angles = scheduleAngle, frequencies = scheduleFrequency);
  Real theta0(unit = "rad") "Angle of the motor, load-referred";
  Real theta0Rate(unit = "rad/s") "Its velocity";
  Real returnWave "b0 of the angles (WBC, rad) or of the velocities (VWBC, rad/s)";
  Real washout(unit = "rad/s") "Low-passed K_p e/2 - b0, omega_h/(s + omega_h)";
  Real integralTorque(unit = "N.m") "Integral part z of tau: z' = (limited tau - z)/T_i";
  Real half(unit = "rad/s") "K_p e/2";
  Real velocityReference(unit = "rad/s") "v";
  Real torque(unit = "N.m") "Asked for, tau";
  Real limit(unit = "N.m") "That the output allows";
  Real limitedTorque(unit = "N.m") "tau within the limit";
protected
  parameter Boolean ofAngles = strategy == Strategy.WBC or strategy == Strategy.WBC_ADAPTIVE "Waves of the angles";
  parameter Boolean adapts = (strategy == Strategy.WBC_ADAPTIVE or strategy == Strategy.VWBC_ADAPTIVE) and adaptationRate > 0.0;
equation
  schedule.angle = loadAngle;
  theta0 = motorAngle / gearRatio;
  theta0Rate = motorVelocity / gearRatio;
  half = positionGain * (positionReference - loadAngle) / 2;
  velocityReference = if strategy == Strategy.P_PI then 2 * half // (CTL-1)
    elseif ofAngles then positionGain * (positionReference / 2 + returnWave - theta0) // (CTL-4)
    elseif strategy == Strategy.VWBC_WASHOUT then half + returnWave + washout // (CTL-6) with one low pass for both
    else half + returnWave; // (CTL-5)
  torque = velocityGain * (velocityReference + velocityFeedforward - theta0Rate) + integralTorque; // (CTL-7)
  limit = currentLimit * gearRatio * torqueConstant; // (CTL-8)
  limitedTorque = if torque > limit then limit elseif torque < -limit then -limit else torque;
end Law;
