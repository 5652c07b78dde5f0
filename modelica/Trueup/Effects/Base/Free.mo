within Trueup.Effects.Base;
block Free "Without effect"
  extends Wrench;
equation
  forceX = 0.0;
  forceY = 0.0;
  torque = 0.0;
  potentialEnergy = 0.0;
end Free;
