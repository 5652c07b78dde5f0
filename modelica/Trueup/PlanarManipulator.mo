within Trueup;
model PlanarManipulator "Planar free-floating manipulator with flexible joints (CBK PAN test-bed, eq. 1-23)"
  // Structure.
  parameter Integer numberOfLinks = 3 "Number of links, n";
  parameter Boolean jointFlexible[numberOfLinks] = {true, false, false} "The joint has its spring";
  parameter Arm.Base base = Arm.Base.free "What becomes of the base";
  parameter Real baseMass(unit = "kg", min = 0) = 58.69 "Satellite, m_0 (ARM-1)";
  parameter Real baseInertia(unit = "kg.m2", min = 0) = 2.42 "Satellite about its centre of mass, I_0 (ARM-1)";
  parameter Real mountPosition[2](each unit = "m") = {0.337, -0.001}
    "Joint 1 from the satellite's centre of mass, in the satellite's axes, p_m (eq. 21)";
  parameter Real linkMass[numberOfLinks](each unit = "kg", each min = 0) = {2.81, 2.82, 4.64} "m_i (eq. 5)";
  parameter Real linkInertia[numberOfLinks](each unit = "kg.m2", each min = 0) = {0.0637, 0.0635, 0.0515}
    "About the link's centre of mass, I_i (eq. 5)";
  parameter Real linkLength[numberOfLinks](each unit = "m", each min = 0) = {0.449, 0.449, 0.31} "From joint to joint, l_i (eq. 21)";
  parameter Real linkCenterOfMass[numberOfLinks, 2](each unit = "m") = {{0.1362, -0.0017}, {0.134, -0.0005}, {0.1511, 0.0004}}
    "From the link's joint, in the link's axes";
  parameter Real motorInertia[numberOfLinks](each unit = "kg.m2", each min = 0) = {5.6, 0.0, 0.0}
    "Gear ratio squared included, I_mi (eq. 6); of a rigid joint: turns with it";
  parameter Real gearRatio[numberOfLinks](each unit = "1", each min = 1) = {100.0, 100.0, 100.0}
    "Motor turns per joint turn, N; used by the geared coupling";
  parameter Real jointStiffness[numberOfLinks](each unit = "N.m/rad", each min = 0) = {5.47, 5.47, 5.47}
    "k_i (eq. 7); unused for a rigid joint";
  parameter Real jointDamping[numberOfLinks](each unit = "N.m.s/rad", each min = 0) = {0.5, 0.5, 0.5}
    "b_i (eq. 8); unused for a rigid joint";
  parameter Real initialBasePosition[2](each unit = "m") = {0.0, 0.0} "x_0, y_0 at the start";
  parameter Real initialBaseAttitude(unit = "rad") = 0.0 "q_0 at the start";
  parameter Real initialBaseVelocity[2](each unit = "m/s") = {0.0, 0.0} "d(x_0), d(y_0) at the start";
  parameter Real initialBaseRate(unit = "rad/s") = 0.0 "d(q_0) at the start";
  parameter Real initialJointAngle[numberOfLinks](each unit = "rad") = {0.0, 0.0, 0.0} "q_i at the start";
  parameter Real initialJointVelocity[numberOfLinks](each unit = "rad/s") = {0.0, 0.0, 0.0} "d(q_i) at the start";
  parameter Real initialMotorAngle[numberOfLinks](each unit = "rad") = initialJointAngle "q_mi at the start; of a rigid joint unused";
  parameter Real initialMotorVelocity[numberOfLinks](each unit = "rad/s") = initialJointVelocity
    "d(q_mi) at the start; of a rigid joint unused";
  parameter Arm.MotorCoupling motorCoupling = Arm.MotorCoupling.paper "How the rotors are coupled to the bodies that carry them";
  parameter Real gravity[2](each unit = "m/s2") = {0.0, 0.0} "Acceleration of free fall, inertial frame (ARM-13); 0 where the base floats";
  input Real jointTorque[numberOfLinks](each unit = "N.m") "Motor torques, tau (eq. 2), joint side; positive turns the joint forward";
  input Real baseForce[2](each unit = "N") "Force on the satellite at its centre of mass, inertial frame";
  input Real baseTorque(unit = "N.m") "Torque on the satellite";
  input Real tipForce[2](each unit = "N") "Force on the last link at its tip, inertial frame";
  input Real tipTorque(unit = "N.m") "Torque on the last link";
  output Real basePosition[2](each unit = "m") "Satellite's centre of mass, x_0, y_0, inertial frame";
  output Real baseAttitude(unit = "rad") "Satellite's attitude, q_0";
  output Real baseVelocity[2](each unit = "m/s") "d(x_0)/dt, d(y_0)/dt";
  output Real baseRate(unit = "rad/s") "d(q_0)/dt";
  output Real jointAngle[numberOfLinks](each unit = "rad") "Link against the link before, q_i";
  output Real jointVelocity[numberOfLinks](each unit = "rad/s") "d(q_i)/dt";
  output Real motorAngle[numberOfLinks](each unit = "rad") "Motor, joint side, against the link before, q_mi; of a rigid joint: the joint's";
  output Real motorVelocity[numberOfLinks](each unit = "rad/s") "d(q_mi)/dt";
  output Real tipPosition[2](each unit = "m") "End-effector, x_e, y_e, inertial frame (eq. 21)";
  output Real tipAttitude(unit = "rad") "Attitude of the last link";
  output Real tipVelocity[2](each unit = "m/s") "d(x_e)/dt, d(y_e)/dt";
  output Real linearMomentum[2](each unit = "kg.m/s") "Of the whole system, inertial frame";
  output Real angularMomentum(unit = "kg.m2/s") "Of the whole system about the inertial origin, rotors included";
  output Real kineticEnergy(unit = "J") "T (eq. 4-6), rotors included";
  output Real potentialEnergy(unit = "J") "V (eq. 7)";
  output Real tipRate(unit = "rad/s") "Of the last link";
  // What effects may change; each place has one block, without effect the neutral one.
  replaceable Effects.Base.Free onBase constrainedby Effects.Base.Interface;
  replaceable Effects.Tip.Free onTip constrainedby Effects.Tip.Interface;
protected
  Real fieldX(unit = "m/s2") "Gravity, and what effects make of the ground (ARM-13)";
  Real fieldY(unit = "m/s2");
  Real tipX(unit = "N") "All of the force on the tip";
  Real tipY(unit = "N");
  // Bodies k = 0 .. n stand at index k + 1; vectors as their x and y.
  Real beyond[numberOfLinks + 1](each unit = "kg") "Mass of all bodies after k, mu_k";
  Real gammaX[numberOfLinks + 1](each unit = "kg.m") "gamma_k in the body's axes (ARM-1)";
  Real gammaY[numberOfLinks + 1](each unit = "kg.m");
  Real inertia[numberOfLinks + 1](each unit = "kg.m2") "alpha_kk + I_k (ARM-1)";
  Real angle[numberOfLinks + 1](each unit = "rad") "phi_k";
  Real rate[numberOfLinks + 1](each unit = "rad/s");
  Real armX[numberOfLinks + 1](each unit = "m") "A_k";
  Real armY[numberOfLinks + 1](each unit = "m");
  Real leverX[numberOfLinks + 1](each unit = "kg.m") "G_k";
  Real leverY[numberOfLinks + 1](each unit = "kg.m");
  Real baseAcceleration[2](each unit = "m/s2");
  Real jointAcceleration[numberOfLinks](each unit = "rad/s2");
  Real motorAcceleration[numberOfLinks](each unit = "rad/s2");
  Real angular[numberOfLinks + 1](each unit = "rad/s2") "dd(phi_k)";
  Real innerX[numberOfLinks + 2](each unit = "m/s2") "Acceleration of the point at which body k is carried, less gravity; last: of the tip";
  Real innerY[numberOfLinks + 2](each unit = "m/s2");
  Real outerX[numberOfLinks + 2](each unit = "N") "What the bodies from k on ask for beyond their carrier's acceleration";
  Real outerY[numberOfLinks + 2](each unit = "N");
  Real share[numberOfLinks](each unit = "1") "How much of the carrier's rate a rotor's equation sees (ARM-5, ARM-6)";
  Real rotor[numberOfLinks](each unit = "N.m") "What the rotor's acceleration takes";
  Real spring[numberOfLinks](each unit = "N.m") "Spring and damper, forward on the link";
  Real drive[numberOfLinks + 2](each unit = "N.m") "Torque on body k from the one before; none on the first and beyond the last";
  Real carried[numberOfLinks + 1](each unit = "N.m") "What the rotor of the next joint takes of body k";
  Real velocityX[numberOfLinks + 2](each unit = "m/s") "Velocity of the point at which body k is carried; last: of the tip";
  Real velocityY[numberOfLinks + 2](each unit = "m/s");
  Real positionX[numberOfLinks + 2](each unit = "m") "Its position";
  Real positionY[numberOfLinks + 2](each unit = "m");
  Real flowX[numberOfLinks + 2](each unit = "kg.m/s") "Momentum of the bodies from k on beyond their carrier's velocity";
  Real flowY[numberOfLinks + 2](each unit = "kg.m/s");
  Real spin[numberOfLinks](each unit = "kg.m2/s") "Of the rotors";
  Real angularFlow[numberOfLinks + 2](each unit = "kg.m2/s") "Sum of the generalized momenta of phi_k from k on";
  Real energy[numberOfLinks + 2](each unit = "J") "Twice the kinetic energy that turns, from k on";
  Real stored[numberOfLinks + 2](each unit = "J") "In the springs and by gravity, from k on";
initial equation
  for i in 1:2 loop
    basePosition[i] = initialBasePosition[i];
    baseVelocity[i] = if base == Arm.Base.fixed then 0.0 else initialBaseVelocity[i];
  end for;
  baseAttitude = initialBaseAttitude;
  baseRate = if base == Arm.Base.fixed then 0.0 else initialBaseRate;
  for j in 1:numberOfLinks loop
    jointAngle[j] = initialJointAngle[j];
    jointVelocity[j] = initialJointVelocity[j];
    motorAngle[j] = if jointFlexible[j] then initialMotorAngle[j] else initialJointAngle[j];
    motorVelocity[j] = if jointFlexible[j] then initialMotorVelocity[j] else initialJointVelocity[j];
  end for;
equation
  // Constants (ARM-1).
  beyond[numberOfLinks + 1] = 0.0;
  for k in 1:numberOfLinks loop
    beyond[k] = beyond[k + 1] + linkMass[k];
    gammaX[k + 1] = linkMass[k] * linkCenterOfMass[k, 1] + beyond[k + 1] * linkLength[k];
    gammaY[k + 1] = linkMass[k] * linkCenterOfMass[k, 2];
    inertia[k + 1] = linkInertia[k] + linkMass[k] * (linkCenterOfMass[k, 1] ^ 2 + linkCenterOfMass[k, 2] ^ 2)
      + beyond[k + 1] * linkLength[k] ^ 2;
    armX[k + 1] = cos(angle[k + 1]) * linkLength[k];
    armY[k + 1] = sin(angle[k + 1]) * linkLength[k];
  end for;
  gammaX[1] = beyond[1] * mountPosition[1];
  gammaY[1] = beyond[1] * mountPosition[2];
  inertia[1] = baseInertia + beyond[1] * (mountPosition[1] ^ 2 + mountPosition[2] ^ 2);
  armX[1] = cos(angle[1]) * mountPosition[1] - sin(angle[1]) * mountPosition[2];
  armY[1] = sin(angle[1]) * mountPosition[1] + cos(angle[1]) * mountPosition[2];
  // Effects.
  onBase.positionX = basePosition[1];
  onBase.positionY = basePosition[2];
  onBase.attitude = baseAttitude;
  onBase.velocityX = baseVelocity[1];
  onBase.velocityY = baseVelocity[2];
  onBase.rate = baseRate;
  fieldX = gravity[1] + onBase.fieldX;
  fieldY = gravity[2] + onBase.fieldY;
  tipX = tipForce[1] + onTip.forceX;
  tipY = tipForce[2] + onTip.forceY;
  // Positions and velocities, from the base outwards (ARM-10).
  angle[1] = baseAttitude;
  rate[1] = baseRate;
  positionX[1] = basePosition[1];
  positionY[1] = basePosition[2];
  velocityX[1] = baseVelocity[1];
  velocityY[1] = baseVelocity[2];
  for k in 1:numberOfLinks loop
    angle[k + 1] = angle[k] + jointAngle[k];
    rate[k + 1] = rate[k] + jointVelocity[k];
  end for;
  for k in 1:numberOfLinks + 1 loop
    leverX[k] = cos(angle[k]) * gammaX[k] - sin(angle[k]) * gammaY[k];
    leverY[k] = sin(angle[k]) * gammaX[k] + cos(angle[k]) * gammaY[k];
    positionX[k + 1] = positionX[k] + armX[k];
    positionY[k + 1] = positionY[k] + armY[k];
    velocityX[k + 1] = velocityX[k] - armY[k] * rate[k];
    velocityY[k + 1] = velocityY[k] + armX[k] * rate[k];
  end for;
  // Accelerations, outwards.
  der(basePosition[1]) = baseVelocity[1];
  der(basePosition[2]) = baseVelocity[2];
  der(baseVelocity[1]) = baseAcceleration[1];
  der(baseVelocity[2]) = baseAcceleration[2];
  der(baseAttitude) = baseRate;
  der(baseRate) = angular[1];
  innerX[1] = baseAcceleration[1] - fieldX; // (ARM-8)
  innerY[1] = baseAcceleration[2] - fieldY;
  for j in 1:numberOfLinks loop
    der(jointAngle[j]) = jointVelocity[j];
    der(jointVelocity[j]) = jointAcceleration[j];
    der(motorAngle[j]) = motorVelocity[j];
    der(motorVelocity[j]) = motorAcceleration[j];
    angular[j + 1] = angular[j] + jointAcceleration[j];
  end for;
  for k in 1:numberOfLinks + 1 loop
    innerX[k + 1] = innerX[k] - armY[k] * angular[k] - armX[k] * rate[k] ^ 2; // (ARM-4)
    innerY[k + 1] = innerY[k] + armX[k] * angular[k] - armY[k] * rate[k] ^ 2;
    outerX[k] = outerX[k + 1] - leverY[k] * angular[k] - leverX[k] * rate[k] ^ 2;
    outerY[k] = outerY[k + 1] + leverX[k] * angular[k] - leverY[k] * rate[k] ^ 2;
  end for;
  outerX[numberOfLinks + 2] = 0.0;
  outerY[numberOfLinks + 2] = 0.0;
  // Drives (ARM-5, ARM-6, ARM-7).
  for j in 1:numberOfLinks loop
    share[j] = if motorCoupling == Arm.MotorCoupling.geared then 1 / gearRatio[j] else 1.0;
    rotor[j] = motorInertia[j] * (share[j] * angular[j] + motorAcceleration[j]);
    spring[j] = jointStiffness[j] * (motorAngle[j] - jointAngle[j]) + jointDamping[j] * (motorVelocity[j] - jointVelocity[j]);
    // A rigid joint's motor turns with it, and what its rotor leaves of the torque goes to the link.
    motorAcceleration[j] = if jointFlexible[j] then (jointTorque[j] - spring[j]) / motorInertia[j] - share[j] * angular[j] else jointAcceleration[j];
    drive[j + 1] = if jointFlexible[j] then spring[j] else jointTorque[j] - rotor[j];
    carried[j] = share[j] * rotor[j];
  end for;
  drive[1] = 0.0;
  drive[numberOfLinks + 2] = 0.0;
  carried[numberOfLinks + 1] = 0.0;
  // Balances in x_0, y_0 and the phi_k: M of ARM-2 and C of ARM-4, summed along the chain; forces of ARM-8.
  0.0 = if base == Arm.Base.fixed then baseAcceleration[1] // (ARM-15)
    else (baseMass + beyond[1]) * innerX[1] + outerX[1] - baseForce[1] - onBase.forceX - tipX;
  0.0 = if base == Arm.Base.fixed then baseAcceleration[2]
    else (baseMass + beyond[1]) * innerY[1] + outerY[1] - baseForce[2] - onBase.forceY - tipY;
  0.0 = if base == Arm.Base.fixed then angular[1]
    else inertia[1] * angular[1] - leverY[1] * innerX[1] + leverX[1] * innerY[1]
      - armY[1] * (outerX[2] - tipX) + armX[1] * (outerY[2] - tipY)
      - baseTorque - onBase.torque - drive[1] + drive[2] + carried[1];
  for k in 2:numberOfLinks + 1 loop
    0.0 = inertia[k] * angular[k] - leverY[k] * innerX[k] + leverX[k] * innerY[k]
      - armY[k] * (outerX[k + 1] - tipX) + armX[k] * (outerY[k + 1] - tipY)
      - drive[k] + drive[k + 1] + carried[k] - (if k == numberOfLinks + 1 then tipTorque + onTip.torque else 0.0);
  end for;
  // The tip.
  tipPosition[1] = positionX[numberOfLinks + 2];
  tipPosition[2] = positionY[numberOfLinks + 2];
  tipVelocity[1] = velocityX[numberOfLinks + 2];
  tipVelocity[2] = velocityY[numberOfLinks + 2];
  tipAttitude = angle[numberOfLinks + 1];
  tipRate = rate[numberOfLinks + 1];
  // Momenta and energies, from the tip inwards (ARM-12, ARM-13).
  flowX[numberOfLinks + 2] = 0.0;
  flowY[numberOfLinks + 2] = 0.0;
  angularFlow[numberOfLinks + 2] = 0.0;
  energy[numberOfLinks + 2] = 0.0;
  stored[numberOfLinks + 2] = 0.0;
  for k in 1:numberOfLinks + 1 loop
    flowX[k] = flowX[k + 1] - leverY[k] * rate[k];
    flowY[k] = flowY[k + 1] + leverX[k] * rate[k];
    stored[k] = stored[k + 1] - fieldX * leverX[k] - fieldY * leverY[k]
      + (if k <= numberOfLinks and jointFlexible[min(k, numberOfLinks)] then
        jointStiffness[min(k, numberOfLinks)] * (motorAngle[min(k, numberOfLinks)] - jointAngle[min(k, numberOfLinks)]) ^ 2 / 2 else 0.0);
  end for;
  for k in 1:numberOfLinks loop
    spin[k] = motorInertia[k] * (share[k] * rate[k] + motorVelocity[k]);
    angularFlow[k] = angularFlow[k + 1] + inertia[k] * rate[k] - leverY[k] * velocityX[k] + leverX[k] * velocityY[k]
      - armY[k] * flowX[k + 1] + armX[k] * flowY[k + 1] + share[k] * spin[k];
    energy[k] = energy[k + 1] + (angularFlow[k] - angularFlow[k + 1]) * rate[k] + spin[k] * motorVelocity[k];
  end for;
  angularFlow[numberOfLinks + 1] = inertia[numberOfLinks + 1] * rate[numberOfLinks + 1]
    - leverY[numberOfLinks + 1] * velocityX[numberOfLinks + 1] + leverX[numberOfLinks + 1] * velocityY[numberOfLinks + 1];
  energy[numberOfLinks + 1] = angularFlow[numberOfLinks + 1] * rate[numberOfLinks + 1];
  linearMomentum[1] = (baseMass + beyond[1]) * baseVelocity[1] + flowX[1];
  linearMomentum[2] = (baseMass + beyond[1]) * baseVelocity[2] + flowY[1];
  angularMomentum = basePosition[1] * linearMomentum[2] - basePosition[2] * linearMomentum[1] + angularFlow[1] + onBase.angularMomentum;
  kineticEnergy = (linearMomentum[1] * baseVelocity[1] + linearMomentum[2] * baseVelocity[2] + energy[1]) / 2 + onBase.kineticEnergy;
  potentialEnergy = stored[1] - (baseMass + beyond[1]) * (fieldX * basePosition[1] + fieldY * basePosition[2]) + onBase.potentialEnergy;
end PlanarManipulator;
