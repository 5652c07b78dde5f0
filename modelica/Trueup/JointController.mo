within Trueup;
block JointController "P/PI and wave-based control of one flexible joint, with current limit; continuous"
  extends Control.Law;
  constant Real samplePeriod(unit = "s") = 0.0 "Continuous; sampled see JointControllerSampled";
  Control.Estimate estimate(start = waveFrequency, adapts = adapts, scheduled = adaptation == Control.Adaptation.schedule,
    speed = adaptationRate, least = waveFrequencyMin, most = waveFrequencyMax, ratio = waveFrequencyRatio,
    threshold = excitationThreshold);
  Control.Split split "Of the angles (WBC) or of the velocities (VWBC)";
initial equation
  washout = 0;
  integralTorque = 0;
equation
  estimate.load = loadAngle;
  estimate.twist = theta0 - loadAngle;
  estimate.schedule = schedule.frequency;
  waveFrequencyUsed = estimate.used;
  adaptationActive = estimate.active;
  split.omega = estimate.used;
  split.growth = estimate.growth;
  split.theta0 = if ofAngles then theta0 else theta0Rate;
  split.theta1 = if ofAngles then loadAngle else loadVelocity;
  returnWave = split.returnWave;
  der(washout) = washoutFrequency * (half - returnWave - washout); // (CTL-6)
  der(integralTorque) = (limitedTorque - integralTorque) / velocityIntegralTime; // (CTL-7)
  motorCurrent = limitedTorque / (gearRatio * torqueConstant); // (CTL-8)
end JointController;
