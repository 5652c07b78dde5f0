within Trueup.Effects.Base;
partial block Wrench "What is a force and a torque alone"
  extends Interface;
equation
  fieldX = 0.0;
  fieldY = 0.0;
  kineticEnergy = 0.0;
  angularMomentum = 0.0;
end Wrench;
