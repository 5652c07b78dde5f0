within Trueup.Effects;
package Sensor "From what an output is to what is read of it; to be put behind any output"
end Sensor;
