within Trueup.Control;
block Split "Launch and return wave of a motion, a0 = theta0 - b0, b0 = G (theta1 - G a0) (CTL-3)"
  input Real omega(unit = "rad/s") "omega_n of G = omega_n^2/(s^2 + omega_n s + omega_n^2) (CTL-2)";
  input Real growth(unit = "1/s") "d(omega_n)/dt over omega_n";
  input Real theta0 "At the actuator";
  input Real theta1 "At the load";
  output Real returnWave "b0";
  Real returnWaveRate;
  Real delayedLaunchWave "G a0";
  Real delayedLaunchWaveRate;
protected
  Real more = growth * (returnWave - delayedLaunchWave) / 2 "So that the twist that came and went leaves nothing (CTL-15)";
  Real moreRate = growth * (returnWaveRate - delayedLaunchWaveRate);
initial equation
  // As at rest.
  returnWave = theta0 / 2;
  returnWaveRate = 0;
  delayedLaunchWave = theta0 / 2;
  delayedLaunchWaveRate = 0;
equation
  der(returnWave) = returnWaveRate + more;
  der(returnWaveRate) = omega * (omega * (theta1 - delayedLaunchWave - returnWave) - returnWaveRate) + moreRate;
  der(delayedLaunchWave) = delayedLaunchWaveRate - more;
  der(delayedLaunchWaveRate) = omega * (omega * (theta0 - returnWave - delayedLaunchWave) - delayedLaunchWaveRate) - moreRate;
end Split;
