within Trueup.Effects.Spring;
block Backlash "backlash: no torque within a gap (EF-3)"
  extends Interface;
  parameter Real backlashGap(unit = "rad", min = 0) = 5.0 "Width of the gap between the faces, on the drive's side of the gear, g (EF-3)";
equation
  torque = if deflection > backlashGap / 2 then stiffness * (deflection - backlashGap / 2) + damping * rate
    elseif deflection < -backlashGap / 2 then stiffness * (deflection + backlashGap / 2) + damping * rate else 0.0;
end Backlash;
