within Trueup.Effects.MotorFriction;
block Paper "Without effect: break-away at tau_s, sliding at tau_c + D_m |omega| (TMJ-4)"
  extends Interface;
equation
  breakawayForward = static;
  breakawayBackward = static;
  brakingForward = coulombFriction + viscousFriction * velocity;
  brakingBackward = coulombFriction - viscousFriction * velocity;
  dry = static;
end Paper;
