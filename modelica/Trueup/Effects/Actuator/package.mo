within Trueup.Effects;
package Actuator "What the amplifier makes of the command"
end Actuator;
