within Trueup.Effects;
package Spring "The compliant element of the transmission, motor side"
end Spring;
