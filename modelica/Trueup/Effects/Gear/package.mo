within Trueup.Effects;
package Gear "Errors of the gear's transmission"
end Gear;
