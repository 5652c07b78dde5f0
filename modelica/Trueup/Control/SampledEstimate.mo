within Trueup.Control;
block SampledEstimate "The same sampled: each lag exact for what it is given, held over the period (CTL-9 to CTL-13)"
  parameter Real start(unit = "rad/s") "omega_n at the start";
  parameter Real samplePeriod(unit = "s") "T_s";
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
  output Real present(unit = "rad/s") "omega_n that a sample finds";
  discrete output Real next(unit = "rad/s") "omega_n that it leaves";
  discrete output Boolean active "omega_n moves";
  discrete Real load1(unit = "rad") "Lags that make s^2 F of theta1";
  discrete Real load2(unit = "rad");
  discrete Real load3(unit = "rad");
  discrete Real twist1(unit = "rad") "Lags that make F of the twist";
  discrete Real twist2(unit = "rad");
  discrete Real twist3(unit = "rad");
  discrete Real excitation(unit = "1") "e";
  discrete Real correlation(unit = "1/s2") "P_yphi";
  discrete Real power(unit = "1") "P_phiphi";
  discrete Real wanted(unit = "rad/s") "omega_n before its bounds";
  discrete Integer samples "So many there have been";
protected
  parameter Real low(unit = "1") = exp(-least / ratio * samplePeriod) "What a lag at the lower corner keeps over a period";
  parameter Real high(unit = "1") = exp(-most / ratio * samplePeriod) "And at the upper one";
  parameter Real keep(unit = "1") = exp(-speed * samplePeriod);
  Real load1Found(unit = "rad") = if pre(samples) == 0 then load else pre(load1);
  Real twist1Found(unit = "rad") = if pre(samples) == 0 then twist else pre(twist1);
  Real y(unit = "1/s2") = (load - load1Found - pre(load2) - pre(load3)) * ((1 - high) / samplePeriod) ^ 2 / threshold;
  Real phi(unit = "1") = pre(twist3) / threshold;
initial equation
  pre(next) = start;
  pre(active) = false;
  pre(load1) = 0.0;
  pre(load2) = 0.0;
  pre(load3) = 0.0;
  pre(twist1) = 0.0;
  pre(twist2) = 0.0;
  pre(twist3) = 0.0;
  pre(excitation) = 0.0;
  pre(correlation) = (start / ratio) ^ 2;
  pre(power) = 1.0;
  pre(wanted) = start;
  pre(samples) = 0;
equation
  present = if adapts then noEvent(min(max(pre(next), least), most)) else start;
  when sample(0, samplePeriod) then
    samples = pre(samples) + 1;
    load1 = load + (load1Found - load) * low;
    load2 = load - load1Found + (pre(load2) - load + load1Found) * high;
    load3 = load - load1Found - pre(load2) + (pre(load3) - load + load1Found + pre(load2)) * high;
    twist1 = twist + (twist1Found - twist) * low;
    twist2 = twist - twist1Found + (pre(twist2) - twist + twist1Found) * high;
    twist3 = twist2 + (pre(twist3) - twist2) * high;
    excitation = phi ^ 2 + (pre(excitation) - phi ^ 2) * low; // (CTL-10)
    active = adapts and (scheduled or excitation > 1.0);
    correlation = if active then y * phi + (pre(correlation) - y * phi) * keep else pre(correlation); // (CTL-11)
    power = if active then phi ^ 2 + (pre(power) - phi ^ 2) * keep else pre(power);
    wanted = min(max(if scheduled then schedule else ratio * sqrt(max(correlation / power, 0.0)), least), most); // (CTL-12)
    next = if active then wanted + (present - wanted) * keep else pre(next); // (CTL-13)
  end when;
end SampledEstimate;
