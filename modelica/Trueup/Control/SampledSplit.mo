within Trueup.Control;
block SampledSplit "The same sampled: each G exact for what it is given, held over the period (CTL-2, CTL-3)"
  parameter Real samplePeriod(unit = "s") "T_s";
  input Real omega(unit = "rad/s") "omega_n that a sample finds";
  input Real omegaNext(unit = "rad/s") "omega_n that it leaves";
  input Real theta0 "At the actuator";
  input Real theta1 "At the load";
  output Real returnWave "b0 as the sample finds it; at the first one as at rest";
  Real delayedLaunchWave "G a0, likewise";
  discrete Real returnWaveNext "b0 from the next sample on";
  discrete Real returnWaveRate;
  discrete Real delayedLaunchWaveNext;
  discrete Real delayedLaunchWaveRate;
  discrete Integer samples "So many there have been";
  Period present(samplePeriod = samplePeriod);
  Period next(samplePeriod = samplePeriod);
protected
  Real b "The states a period later, with omega_n as it was";
  Real bRate;
  Real g;
  Real gRate;
  Real rate "d(b0 - G a0)/dt with omega_n as it is then";
  Real half "What the change of omega_n adds to b0 and takes from G a0 (CTL-15)";
initial equation
  pre(returnWaveNext) = 0.0;
  pre(returnWaveRate) = 0.0;
  pre(delayedLaunchWaveNext) = 0.0;
  pre(delayedLaunchWaveRate) = 0.0;
  pre(samples) = 0;
equation
  present.omega = omega;
  next.omega = omegaNext;
  returnWave = if pre(samples) == 0 then theta0 / 2 else pre(returnWaveNext);
  delayedLaunchWave = if pre(samples) == 0 then theta0 / 2 else pre(delayedLaunchWaveNext);
  b = theta1 - delayedLaunchWave + (returnWave - theta1 + delayedLaunchWave) * (present.cosine + present.sine)
    + 2 * pre(returnWaveRate) * present.sine / omega;
  bRate = pre(returnWaveRate) * (present.cosine - present.sine)
    - 2 * omega * present.sine * (returnWave - theta1 + delayedLaunchWave);
  g = theta0 - returnWave + (delayedLaunchWave - theta0 + returnWave) * (present.cosine + present.sine)
    + 2 * pre(delayedLaunchWaveRate) * present.sine / omega;
  gRate = pre(delayedLaunchWaveRate) * (present.cosine - present.sine)
    - 2 * omega * present.sine * (delayedLaunchWave - theta0 + returnWave);
  rate = (bRate - gRate) * (omegaNext / omega) ^ 2;
  half = ((b - g + (bRate - gRate) * present.alpha) * next.beta / present.beta - rate * next.alpha - b + g) / 2;
  when sample(0, samplePeriod) then
    samples = pre(samples) + 1;
    returnWaveNext = b + half;
    returnWaveRate = bRate + (rate - bRate + gRate) / 2;
    delayedLaunchWaveNext = g - half;
    delayedLaunchWaveRate = gRate - (rate - bRate + gRate) / 2;
  end when;
end SampledSplit;
