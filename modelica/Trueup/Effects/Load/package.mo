within Trueup.Effects;
package Load "Torque on the load from outside the drive train"
end Load;
