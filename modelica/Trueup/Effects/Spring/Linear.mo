within Trueup.Effects.Spring;
block Linear "Without effect (TMJ-2)"
  extends Interface;
equation
  torque = stiffness * deflection + damping * rate;
end Linear;
