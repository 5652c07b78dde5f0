within Trueup;
block JointController "P/PI and wave-based control of one flexible joint, with current limit; continuous"
  extends Control.Law;
  constant Real samplePeriod(unit = "s") = 0.0 "Continuous; sampled see JointControllerSampled";
  Control.Split split(omega = waveFrequency) "Of the angles (WBC) or of the velocities (VWBC)";
initial equation
  washout = 0;
  integralTorque = 0;
equation
  split.theta0 = if strategy == Control.Strategy.WBC then theta0 else theta0Rate;
  split.theta1 = if strategy == Control.Strategy.WBC then loadAngle else loadVelocity;
  returnWave = split.returnWave;
  der(washout) = washoutFrequency * (half - returnWave - washout); // (CTL-6)
  der(integralTorque) = (limitedTorque - integralTorque) / velocityIntegralTime; // (CTL-7)
  motorCurrent = limitedTorque / (gearRatio * torqueConstant); // (CTL-8)
end JointController;
