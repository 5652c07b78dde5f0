within Trueup.Control;
block Period "G's free motion after one period, and what a sampled split makes of a twist (CTL-2, CTL-15)"
  parameter Real samplePeriod(unit = "s") "T_s";
  input Real omega(unit = "rad/s") "omega_n";
  output Real sine "Over sqrt(3)";
  output Real cosine;
  output Real alpha(unit = "s") "The sum over the twist is (d + alpha d(d)) / beta, d = b0 - G a0";
  output Real beta(unit = "1");
equation
  sine = exp(-omega * samplePeriod / 2) * sin(omega * samplePeriod * sqrt(3) / 2) / sqrt(3);
  cosine = exp(-omega * samplePeriod / 2) * cos(omega * samplePeriod * sqrt(3) / 2);
  alpha = 2 * sine / (omega * (1 - cosine + sine));
  beta = ((1 - cosine) ^ 2 + 3 * sine ^ 2) / (1 - cosine + sine);
end Period;
