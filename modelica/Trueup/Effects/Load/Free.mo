within Trueup.Effects.Load;
block Free "Without effect"
  extends Interface;
equation
  torque = 0.0;
end Free;
