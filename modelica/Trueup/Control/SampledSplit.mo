within Trueup.Control;
block SampledSplit "The same sampled: each G exact for what it is given, held over the period (CTL-2, CTL-3)"
  parameter Real omega(unit = "rad/s") "omega_n";
  parameter Real samplePeriod(unit = "s") "T_s";
  input Real theta0 "At the actuator";
  input Real theta1 "At the load";
  output Real returnWave "b0 as the sample finds it; at the first one as at rest";
  Real delayedLaunchWave "G a0, likewise";
  discrete Real returnWaveNext "b0 from the next sample on";
  discrete Real returnWaveRate;
  discrete Real delayedLaunchWaveNext;
  discrete Real delayedLaunchWaveRate;
  discrete Integer samples "So many there have been";
protected
  parameter Real angle = omega * samplePeriod * sqrt(3) / 2;
  parameter Real sine = exp(-omega * samplePeriod / 2) * sin(angle) / sqrt(3) "G's free motion after one period";
  parameter Real cosine = exp(-omega * samplePeriod / 2) * cos(angle);
initial equation
  pre(returnWaveNext) = 0.0;
  pre(returnWaveRate) = 0.0;
  pre(delayedLaunchWaveNext) = 0.0;
  pre(delayedLaunchWaveRate) = 0.0;
  pre(samples) = 0;
equation
  returnWave = if pre(samples) == 0 then theta0 / 2 else pre(returnWaveNext);
  delayedLaunchWave = if pre(samples) == 0 then theta0 / 2 else pre(delayedLaunchWaveNext);
  when sample(0, samplePeriod) then
    samples = pre(samples) + 1;
    returnWaveNext = theta1 - delayedLaunchWave + (returnWave - theta1 + delayedLaunchWave) * (cosine + sine)
      + 2 * pre(returnWaveRate) * sine / omega;
    returnWaveRate = pre(returnWaveRate) * (cosine - sine) - 2 * omega * sine * (returnWave - theta1 + delayedLaunchWave);
    delayedLaunchWaveNext = theta0 - returnWave + (delayedLaunchWave - theta0 + returnWave) * (cosine + sine)
      + 2 * pre(delayedLaunchWaveRate) * sine / omega;
    delayedLaunchWaveRate = pre(delayedLaunchWaveRate) * (cosine - sine)
      - 2 * omega * sine * (delayedLaunchWave - theta0 + returnWave);
  end when;
end SampledSplit;
