within Trueup.Effects;
package MotorFriction "Levels of the friction at the motor"
end MotorFriction;
