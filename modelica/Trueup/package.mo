within;
package Trueup "The models of Trueup's FMUs: the same equations, names, units and defaults, to be read and run as Modelica"
  annotation (version = "0.2.0", Documentation(info = "<html><p>Plain Modelica 3.4 that needs no other library.
One class per FMU; what an effect may change in the joint is a replaceable block of <code>Trueup.Effects</code>. In comments, ids as
(TMJ-1) are those of Trueup's <code>docs/equations</code> and <code>docs/effects.md</code>. SI units throughout.</p></html>"));
end Trueup;
