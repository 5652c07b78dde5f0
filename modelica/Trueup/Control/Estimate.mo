within Trueup.Control;
block Estimate "omega_n by recursive least squares from motor and load angle, or by the schedule (CTL-9 to CTL-13)"
  parameter Real start(unit = "rad/s") "omega_n at the start";
  parameter Boolean adapts;
  parameter Boolean scheduled "By the schedule";
  parameter Real speed(unit = "1/s") "lambda";
  parameter Real least(unit = "rad/s");
  parameter Real most(unit = "rad/s");
  parameter Real ratio(unit = "1");
  parameter Real threshold(unit = "rad") "eps";
  input Real load(unit = "rad") "theta1";
  input Real twist(unit = "rad") "theta0 - theta1";
  input Real schedule(unit = "rad/s") "What the schedule says";
  output Real used(unit = "rad/s") "omega_n";
  output Real growth(unit = "1/s") "d(omega_n)/dt over omega_n";
  output Boolean active "omega_n moves";
  Real offset(unit = "rad/s") "omega_n less its start";
  Real load1(unit = "rad") "Lags that make s^2 F of theta1";
  Real load2(unit = "rad");
  Real load3(unit = "rad");
  Real twist1(unit = "rad") "Lags that make F of the twist";
  Real twist2(unit = "rad");
  Real twist3(unit = "rad");
  Real excitation(unit = "1") "e";
  Real correlation(unit = "1/s2") "P_yphi";
  Real power(unit = "1", start = 1.0) "P_phiphi";
protected
  parameter Real low(unit = "rad/s") = least / ratio "Lower corner, omega_l";
  parameter Real high(unit = "rad/s") = most / ratio "Upper corner, omega_u";
  Real y(unit = "1/s2") = (load - load1 - load2 - load3) * high ^ 2 / threshold; // (CTL-9)
  Real phi(unit = "1") = twist3 / threshold;
  Real wanted(unit = "rad/s") "omega_n before its bounds";
initial equation
  offset = 0.0;
  load1 = load;
  load2 = 0.0;
  load3 = 0.0;
  twist1 = twist;
  twist2 = 0.0;
  twist3 = 0.0;
  excitation = 0.0;
  correlation = (start / ratio) ^ 2;
  power = 1.0;
equation
  der(load1) = low * (load - load1);
  der(load2) = high * (load - load1 - load2);
  der(load3) = high * (load - load1 - load2 - load3);
  der(twist1) = low * (twist - twist1);
  der(twist2) = high * (twist - twist1 - twist2);
  der(twist3) = high * (twist2 - twist3);
  der(excitation) = low * (phi ^ 2 - excitation); // (CTL-10)
  active = adapts and (scheduled or excitation > 1.0);
  der(correlation) = if active then speed * (y * phi - correlation) else 0.0; // (CTL-11)
  der(power) = if active then speed * (phi ^ 2 - power) else 0.0;
  wanted = if scheduled then schedule else ratio * sqrt(noEvent(max(correlation / power, 0.0)));
  used = if adapts then noEvent(min(max(start + offset, least), most)) else start;
  der(offset) = if active then speed * (noEvent(min(max(wanted, least), most)) - used) else 0.0; // (CTL-12, CTL-13)
  growth = (if active then speed * (noEvent(min(max(wanted, least), most)) - used) else 0.0) / used;
end Estimate;
