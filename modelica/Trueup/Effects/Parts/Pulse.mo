within Trueup.Effects.Parts;
block Pulse "1 for a while: E(t - t_0) - E(t - t_0 - d), with edges of half a cosine (EF-25)"
  parameter Real begin(unit = "s") "t_0";
  parameter Real duration(unit = "s") "d, from the begin of the first edge to that of the second";
  parameter Real edge(unit = "s") "r; 0: sharp";
  output Real level(unit = "1");
protected
  constant Real pi = 3.141592653589793;
equation
  level = (if time < begin then 0.0 elseif time < begin + edge then (1 - cos(pi * (time - begin) / edge)) / 2 else 1.0)
    - (if time < begin + duration then 0.0
      elseif time < begin + duration + edge then (1 - cos(pi * (time - begin - duration) / edge)) / 2 else 1.0);
end Pulse;
