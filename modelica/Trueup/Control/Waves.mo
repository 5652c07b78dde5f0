within Trueup.Control;
partial block Waves "The wave frequency as it adapts: parameters, and what it goes to"
  parameter Real waveFrequency(unit = "rad/s", min = 0) = 41.648
    "omega_n of the wave transfer function G = omega_n^2/(s^2 + omega_n s + omega_n^2), a setting of the damping";
  parameter Adaptation adaptation = Adaptation.estimate "Where omega_n of WBC_ADAPTIVE and VWBC_ADAPTIVE comes from";
  parameter Real adaptationRate(unit = "1/s", min = 0) = 1.0
    "lambda: how fast omega_n used goes from waveFrequency to what it should be, and how fast the estimate forgets; 0: waveFrequency throughout";
  parameter Real waveFrequencyMin(unit = "rad/s", min = 0) = 8.329600000000001
    "Smallest omega_n used; over waveFrequencyRatio the lower corner of the estimate's band pass";
  parameter Real waveFrequencyMax(unit = "rad/s", min = 0) = 208.24
    "Largest omega_n used; over waveFrequencyRatio the upper corner of the estimate's band pass";
  parameter Real waveFrequencyRatio(unit = "1", min = 0) = 1.0 "omega_n over the estimated mode sqrt(K/J) of the joint with its motor held";
  parameter Real excitationThreshold(unit = "rad", min = 0) = 5e-5
    "Root mean square of the filtered twist motorAngle/gearRatio - theta1 below which the estimate is held: above what the steps of the sensors make";
  parameter Real scheduleAngle[9](each unit = "rad") = {-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0}
    "Knots of the schedule, ascending: loadAngle";
  parameter Real scheduleFrequency[9](each unit = "rad/s", each min = 0) =
    {41.648, 41.648, 41.648, 41.648, 41.648, 41.648, 41.648, 41.648, 41.648}
    "omega_n at the knots, linear in between, held beyond the first and the last one";
  output Real waveFrequencyUsed(unit = "rad/s") "omega_n that the waves use; waveFrequency where the strategy does not adapt";
  output Boolean adaptationActive "omega_n moves: a schedule, or an estimate with enough excitation";
end Waves;
