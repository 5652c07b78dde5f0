within Trueup;
block JointControllerSampled "P/PI and wave-based control of one flexible joint, with current limit; sampled, its output held"
  extends Control.Law;
  parameter Real samplePeriod(unit = "s", min = 0) = 1e-3 "Sample period T_s of the controller, output held in between";
  Control.SampledEstimate estimate(samplePeriod = samplePeriod, start = waveFrequency, adapts = adapts, scheduled = adaptation == Control.Adaptation.schedule,
    speed = adaptationRate, least = waveFrequencyMin, most = waveFrequencyMax, ratio = waveFrequencyRatio,
    threshold = excitationThreshold);
  Control.SampledSplit split(samplePeriod = samplePeriod) "Of the angles (WBC) or of the velocities (VWBC)";
  discrete Real washoutNext(unit = "rad/s") "washout from the next sample on";
  discrete Real integralNext(unit = "N.m") "integralTorque from the next sample on";
  discrete Real held(unit = "A") "motorCurrent of the last sample";
initial equation
  pre(washoutNext) = 0.0;
  pre(integralNext) = 0.0;
equation
  estimate.load = loadAngle;
  estimate.twist = theta0 - loadAngle;
  estimate.schedule = schedule.frequency;
  waveFrequencyUsed = if adapts then estimate.next else waveFrequency;
  adaptationActive = estimate.active;
  split.omega = estimate.present;
  split.omegaNext = waveFrequencyUsed;
  split.theta0 = if ofAngles then theta0 else theta0Rate;
  split.theta1 = if ofAngles then loadAngle else loadVelocity;
  returnWave = split.returnWave;
  washout = pre(washoutNext);
  integralTorque = pre(integralNext);
  when sample(0, samplePeriod) then
    held = limitedTorque / (gearRatio * torqueConstant); // (CTL-8)
    // Exact for inputs that are held (CTL-6, CTL-7).
    washoutNext = half - returnWave + (washout - half + returnWave) * exp(-samplePeriod * washoutFrequency);
    integralNext = limitedTorque + (integralTorque - limitedTorque) * exp(-samplePeriod / velocityIntegralTime);
  end when;
  motorCurrent = held;
end JointControllerSampled;
