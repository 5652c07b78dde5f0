within Trueup.Effects.Tip;
block Free "Without effect"
  extends Interface;
equation
  forceX = 0.0;
  forceY = 0.0;
  torque = 0.0;
end Free;
