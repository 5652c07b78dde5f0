within Trueup.Effects.Load;
block FlexibleLink "flexible-link: a tip inertia on a spring; loadInertia is the hub's then (EF-6)"
  extends Interface;
  parameter Real tipInertia(unit = "kg.m2", min = 0) = 6.0 "Moment of inertia of the tip, J_2 (EF-6)";
  parameter Real linkStiffness(unit = "N.m/rad", min = 0) = 1555.0 "Stiffness between hub and tip, K_2 (EF-6)";
  parameter Real linkDamping(unit = "N.m.s/rad", min = 0) = 0.966 "Damping between hub and tip, D_2 (EF-6)";
  output Real tipAngle(unit = "rad") "Angle of the tip, q_2 (EF-6)";
  output Real tipVelocity(unit = "rad/s") "Velocity of the tip (EF-6)";
initial equation
  tipAngle = angle;
  tipVelocity = velocity;
equation
  torque = linkStiffness * (tipAngle - angle) + linkDamping * (tipVelocity - velocity);
  der(tipAngle) = tipVelocity;
  tipInertia * der(tipVelocity) = -torque;
end FlexibleLink;
