within Trueup.Effects;
package Tip "What acts on an arm's tip"
end Tip;
