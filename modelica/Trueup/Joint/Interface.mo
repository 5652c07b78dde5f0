within Trueup.Joint;
partial model Interface "What the joint has with its spring and without: variables, places of effects, the motor's motion"
  parameter Real motorInertia(unit = "kg.m2", min = 0) = 1.2e-7 "Motor with planetary stage, J_motor (TMJ-1)";
  parameter Real loadInertia(unit = "kg.m2", min = 0) = 8.0 "Load, load side, J_load (TMJ-3)";
  parameter Real gearRatio(unit = "1", min = 0) = 44340.0 "Motor turns per load turn, n_eq (TMJ-2)";
  parameter Real torqueConstant(unit = "N.m/A") = 0.02 "Motor torque per current, K_t (TMJ-1)";
  parameter Real stiffness(unit = "N.m/rad", min = 0) = 3.07e-5 "Transmission, motor side, K_eq (TMJ-2)";
  parameter Real damping(unit = "N.m.s/rad", min = 0) = 8.07e-8 "Transmission, motor side, D_eq (TMJ-2)";
  parameter Real coulombFriction(unit = "N.m", min = 0) = 7.37e-5 "At the motor, tau_c (TMJ-4)";
  parameter Real staticFriction(unit = "N.m", min = 0) = 2.99e-4
    "Break-away level at the motor, tau_s (TMJ-4); taken as tau_c where it is below";
  parameter Real viscousFriction(unit = "N.m.s/rad", min = 0) = 7.2e-8 "At the motor, D_m (TMJ-4)";
  parameter Real initialMotorAngle(unit = "rad") = 0.0 "q_m at the start";
  parameter Real initialMotorVelocity(unit = "rad/s") = 0.0 "d(q_m)/dt at the start";
  parameter Real initialLoadAngle(unit = "rad") = 0.0 "q_l at the start";
  parameter Real initialLoadVelocity(unit = "rad/s") = 0.0 "d(q_l)/dt at the start";
  input Real motorCurrent(unit = "A") "Motor current, I (TMJ-1); positive drives the motor forward";
  input Real externalTorque(unit = "N.m") "Torque on the load, tau_ext (TMJ-3); positive drives the load forward";
  output Real motorAngle(unit = "rad") "Motor angle, q_m";
  output Real motorVelocity(unit = "rad/s") "Motor velocity, d(q_m)/dt";
  output Real motorAcceleration(unit = "rad/s2") "Motor acceleration, dd(q_m)/dt2 (TMJ-1)";
  output Real loadAngle(unit = "rad") "Load angle, q_l";
  output Real loadVelocity(unit = "rad/s") "Load velocity, d(q_l)/dt";
  output Real loadAcceleration(unit = "rad/s2") "Load acceleration, dd(q_l)/dt2 (TMJ-3)";
  output Real motorTorque(unit = "N.m") "Torque of the motor, K_t I (TMJ-1)";
  output Real transmissionTorque(unit = "N.m") "Motor side, tau_lm (TMJ-2); positive drives the load forward";
  output Real frictionTorque(unit = "N.m") "At the motor, tau_fr (TMJ-4); positive against forward motion";
  output Boolean sticking "The motor sticks (TMJ-4)";
  // What effects may change; each place has one block, without effect the neutral one.
  replaceable Effects.Actuator.Ideal actuator constrainedby Effects.Actuator.Interface;
  replaceable Effects.MotorFriction.Paper friction constrainedby Effects.MotorFriction.Interface;
  replaceable Effects.Load.Free load constrainedby Effects.Load.Interface;
  Friction.Modes modes;
protected
  Real braked(unit = "kg.m2") "What friction brakes, motor side";
initial equation
  motorAngle = initialMotorAngle;
  motorVelocity = initialMotorVelocity;
equation
  actuator.command = torqueConstant * motorCurrent;
  actuator.angle = motorAngle;
  motorTorque = actuator.torque;
  friction.coulombFriction = coulombFriction;
  friction.staticFriction = staticFriction;
  friction.viscousFriction = viscousFriction;
  friction.velocity = motorVelocity;
  load.angle = loadAngle;
  load.velocity = loadVelocity;
  modes.velocity = motorVelocity;
  modes.breakawayForward = friction.breakawayForward;
  modes.breakawayBackward = friction.breakawayBackward;
  modes.brakingForward = friction.brakingForward;
  modes.brakingBackward = friction.brakingBackward;
  modes.dry = friction.dry;
  frictionTorque = modes.torque; // (TMJ-4)
  sticking = modes.mode == 0;
  der(motorAngle) = motorVelocity;
  motorAcceleration = if sticking then 0.0 else (modes.applied - frictionTorque) / braked; // (TMJ-1, TMJ-5)
  der(motorVelocity) = motorAcceleration;
  when change(modes.stops) then
    reinit(motorVelocity, 0.0);
  end when;
end Interface;
