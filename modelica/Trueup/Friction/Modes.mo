within Trueup.Friction;
block Modes "Which way a motor slides, or that it sticks (TMJ-4)"
  constant Real turned(unit = "rad/s") = 1e-11 "A motor that runs backwards by this much has turned: far below anything measurable";
  input Real velocity(unit = "rad/s") "Of the motor";
  input Real applied(unit = "N.m") "What friction has to balance for the motor to stick";
  input Real breakawayForward(unit = "N.m") "Up to this much the joint holds a motor driven forward";
  input Real breakawayBackward(unit = "N.m") "The same backward";
  input Real brakingForward(unit = "N.m") "What brakes while it slides forward";
  input Real brakingBackward(unit = "N.m") "The same backward";
  input Real dry "Above 0: there is dry friction at all";
  output Real torque(unit = "N.m") "Of friction, against forward motion";
  discrete output Integer mode "1, -1: slides that way; 0: sticks; 2: no dry friction, no events";
  discrete output Integer stops "How often the motor has turned; at each its velocity is to be set to 0";
initial equation
  pre(mode) = if dry <= 0 then 2 elseif velocity > turned then 1 elseif velocity < -turned then -1 else 0;
  pre(stops) = 0;
equation
  // Sliding it brakes, sticking it balances (TMJ-4).
  torque = if mode == 0 then applied
    elseif mode == 1 or mode == 2 and noEvent(velocity >= 0) then brakingForward else -brakingBackward;
  // No event looks at the mode of its own instant: what is applied does not depend on it. The first mode of a motor at rest is
  // found here, not in an initial equation: what is applied may come from something sampled.
  when {initial(), pre(mode) == 0 and applied > breakawayForward, pre(mode) == 0 and -applied > breakawayBackward,
      pre(mode) == 1 and velocity < -turned, pre(mode) == -1 and velocity > turned} then
    mode = if initial() and pre(mode) <> 0 then pre(mode)
      elseif applied >= breakawayForward then 1 elseif -applied >= breakawayBackward then -1 else 0;
    stops = if initial() or pre(mode) == 0 then pre(stops) else pre(stops) + 1;
  end when;
end Modes;
