within Trueup.Effects.Spring;
block NonlinearStiffness "nonlinear-stiffness: hardening or softening with the cube, and from a knee on (EF-4)"
  extends Interface;
  parameter Real cubicStiffness(unit = "N.m/rad3") = 1e-6 "Torque per cube of the deflection, K_3 (EF-4)";
  parameter Real kneeStiffness(unit = "N.m/rad") = 0.0 "What the stiffness is more beyond the knee, K_k (EF-4); 0: there is no knee";
  parameter Real kneeDeflection(unit = "rad", min = 0) = 10.0 "Deflection at the knee, delta_k (EF-4)";
protected
  Real beyond(unit = "rad") "Deflection beyond the knee, with its sign";
equation
  beyond = noEvent(if deflection > kneeDeflection then deflection - kneeDeflection
    elseif deflection < -kneeDeflection then deflection + kneeDeflection else 0.0);
  torque = stiffness * deflection + damping * rate + cubicStiffness * deflection ^ 3 + kneeStiffness * beyond;
end NonlinearStiffness;
