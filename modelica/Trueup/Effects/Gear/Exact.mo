within Trueup.Effects.Gear;
block Exact "Without effect"
  extends Interface;
equation
  error = 0.0;
  slope = 0.0;
end Exact;
