within Trueup.Control;
type Adaptation = enumeration(
    schedule "omega_n from a table over an angle: scheduleAngle, scheduleFrequency",
    estimate "omega_n = waveFrequencyRatio times the mode that recursive least squares find in motor and load angle")
  "Where the wave frequency of an adaptive strategy comes from";
