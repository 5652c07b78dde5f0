within Trueup.Control;
type Strategy = enumeration(
    P_PI "v = K_p e",
    WBC "wave-based control, v = K_p (r/2 + b0 - theta0) with the waves of the angles",
    VWBC "velocity wave-based control, v = K_p e/2 + b0 with the waves of the velocities",
    VWBC_WASHOUT "v = K_p e (1 + LP)/2 + (1 - LP) b0, LP = omega_h/(s + omega_h): no static error under a load torque",
    WBC_ADAPTIVE "WBC with a wave frequency that adapts, see adaptation",
    VWBC_ADAPTIVE "VWBC with a wave frequency that adapts, see adaptation")
  "Velocity reference v of a joint's controller, with e = r - theta1";
