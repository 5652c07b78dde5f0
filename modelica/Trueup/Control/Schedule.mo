within Trueup.Control;
block Schedule "A table over an angle: straight between its knots, held beyond the first and the last one (CTL-14)"
  parameter Real angles[9](each unit = "rad");
  parameter Real frequencies[9](each unit = "rad/s");
  input Real angle(unit = "rad");
  output Real frequency(unit = "rad/s");
protected
  Real upTo[9](each unit = "rad/s") "What the knots up to this one make of it";
equation
  upTo[1] = frequencies[1];
  for k in 1:8 loop
    upTo[k + 1] = upTo[k] + (frequencies[k + 1] - frequencies[k])
      * noEvent(min(max((angle - angles[k]) / (angles[k + 1] - angles[k]), 0.0), 1.0));
  end for;
  frequency = upTo[9];
end Schedule;
