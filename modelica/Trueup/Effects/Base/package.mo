within Trueup.Effects;
package Base "What acts on an arm's base, or on all of the arm"
end Base;
