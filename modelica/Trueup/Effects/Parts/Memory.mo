within Trueup.Effects.Parts;
block Memory "A signal as it was: its recent past as a polynomial (EF-11, EF-30)"
  parameter Real delay(unit = "s", min = 0) "d";
  input Real signal;
  input Real before "What it was before the start";
  output Real delayed "As it was d seconds ago";
  Real past0 "Legendre coefficients of the last W seconds";
  Real past1;
  Real past2;
  Real past3;
protected
  constant Real shortest(unit = "s") = 5e-3;
  parameter Real window(unit = "s") = sqrt(delay ^ 2 + shortest ^ 2) "W";
  parameter Real at = 2 * delay / window - 1 "Where in the window it is read: -1 now, 1 at its far end";
initial equation
  past0 = before;
  past1 = 0.0;
  past2 = 0.0;
  past3 = 0.0;
equation
  window * der(past0) = signal - past0 - past1 - past2 - past3;
  window * der(past1) = 3 * (-signal + past0 - past1 - past2 - past3);
  window * der(past2) = 5 * (signal - past0 + past1 - past2 - past3);
  window * der(past3) = 7 * (-signal + past0 - past1 + past2 - past3);
  // What the polynomial lacks of the present is added the more, the shorter the delay.
  delayed = past0 + at * past1 + (3 * at ^ 2 - 1) / 2 * past2 + at * (5 * at ^ 2 - 3) / 2 * past3
    + (signal - past0 + past1 - past2 + past3) * (shortest / window) ^ 4;
end Memory;
