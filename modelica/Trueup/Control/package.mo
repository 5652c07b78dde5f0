within Trueup;
package Control "What the controllers of a joint are made of"
end Control;
