within Trueup.Effects.Spring;
block NonlinearDamping "nonlinear-damping: tau_n (|r|/r_n)^p against the rate of the deformation (EF-18)"
  extends Interface;
  parameter Real dampingTorque(unit = "N.m", min = 0) = 2e-5 "Torque at the reference rate, tau_n (EF-18)";
  parameter Real dampingExponent(unit = "1", min = 0.3, max = 4) = 2.0 "Exponent of the rate, p (EF-18); 1 is linear damping";
  parameter Real dampingReferenceRate(unit = "rad/s", min = 0) = 100.0 "Rate of the deformation at which the torque is tau_n, r_n (EF-18)";
protected
  Real share(unit = "1") = rate / dampingReferenceRate;
equation
  // Straight below a hundredth of the reference.
  torque = stiffness * deflection + damping * rate
    + dampingTorque * share * (share ^ 2 + 0.01 ^ 2) ^ ((dampingExponent - 1) / 2);
end NonlinearDamping;
