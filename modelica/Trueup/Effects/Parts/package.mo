within Trueup.Effects;
package Parts "What several effects are made of"
end Parts;
