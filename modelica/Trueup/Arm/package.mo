within Trueup;
package Arm "What may be chosen of an arm"
end Arm;
