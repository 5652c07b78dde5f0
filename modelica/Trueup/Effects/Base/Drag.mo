within Trueup.Effects.Base;
block Drag "base-drag: air bearings that drag (EF-9)"
  extends Wrench;
  parameter Real baseDrag(unit = "N.s/m", min = 0) = 2.0 "Force per velocity of the base, c_t (EF-9)";
  parameter Real baseRotationalDrag(unit = "N.m.s/rad", min = 0) = 0.2 "Torque per rate of the base, c_r (EF-9)";
equation
  forceX = -baseDrag * velocityX;
  forceY = -baseDrag * velocityY;
  torque = -baseRotationalDrag * rate;
  potentialEnergy = 0.0;
end Drag;
