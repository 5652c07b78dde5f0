within Trueup.Effects.Sensor;
block Eccentricity "sensor-eccentricity: a reading error that repeats with the angle (EF-31)"
  extends Interface(actual(unit = "rad"), reading(unit = "rad"));
  parameter Real eccentricitySine(unit = "rad") = 0.01 "Reading error that goes with the sine of the angle, a_s (EF-31)";
  parameter Real eccentricityCosine(unit = "rad") = 0.0 "Reading error that goes with the cosine of the angle, a_c (EF-31)";
  parameter Real eccentricityOrder(unit = "1", min = 1) = 1.0 "Periods per turn, k (EF-31)";
equation
  reading = actual + eccentricitySine * sin(eccentricityOrder * actual) + eccentricityCosine * cos(eccentricityOrder * actual);
end Eccentricity;
