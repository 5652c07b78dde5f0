within Trueup.Effects.Sensor;
partial block Interface "Between an output and its reading; parameters in the FMU bear the channel's name before theirs"
  input Real actual "What the output is";
  output Real reading "What is read";
end Interface;
