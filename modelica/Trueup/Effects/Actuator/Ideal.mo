within Trueup.Effects.Actuator;
block Ideal "Without effect"
  extends Interface;
equation
  torque = command;
end Ideal;
