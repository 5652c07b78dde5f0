within Trueup.Arm;
type MotorCoupling = enumeration(
    paper "as printed: I_m turns with the motor angle, the carrier feels all of I_m",
    geared "rotor behind a gear: the carrier feels I_m/N and I_m/N^2")
  "How a motor's rotor is coupled to the body that carries it";
