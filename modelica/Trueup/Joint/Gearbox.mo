within Trueup.Joint;
record Gearbox "Two gear stages in series as the joint's one (GB-1); stiffness and damping on each stage's input side"
  parameter Real planetaryStiffness(unit = "N.m/rad", min = 0) "K_pl, the stage at the motor";
  parameter Real planetaryDamping(unit = "N.m.s/rad", min = 0) "D_pl";
  parameter Real planetaryRatio(unit = "1", min = 1) "n_pl";
  parameter Real planetaryInertia(unit = "kg.m2", min = 0) = 0.0 "J_pl, at its input";
  parameter Real harmonicDriveStiffness(unit = "N.m/rad", min = 0) "K_hd, the stage at the load";
  parameter Real harmonicDriveDamping(unit = "N.m.s/rad", min = 0) "D_hd";
  parameter Real harmonicDriveRatio(unit = "1", min = 1) "n_hd";
  parameter Real harmonicDriveInertia(unit = "kg.m2", min = 0) = 0.0 "J_hd, at its input";
  parameter Real ownMotorInertia(unit = "kg.m2", min = 0) "J_m";
  parameter Real ownLoadInertia(unit = "kg.m2", min = 0) "J_l";
  // What the joint's parameters of these names are.
  parameter Real gearRatio(unit = "1") = planetaryRatio * harmonicDriveRatio;
  parameter Real stiffness(unit = "N.m/rad") =
    planetaryStiffness * harmonicDriveStiffness / (harmonicDriveStiffness + planetaryStiffness * planetaryRatio ^ 2);
  parameter Real damping(unit = "N.m.s/rad") =
    (harmonicDriveStiffness ^ 2 * planetaryDamping + planetaryRatio ^ 2 * planetaryStiffness ^ 2 * harmonicDriveDamping)
    / (harmonicDriveStiffness + planetaryStiffness * planetaryRatio ^ 2) ^ 2;
  parameter Real motorInertia(unit = "kg.m2") = ownMotorInertia + planetaryInertia;
  parameter Real loadInertia(unit = "kg.m2") = ownLoadInertia + harmonicDriveInertia * harmonicDriveRatio ^ 2;
end Gearbox;
