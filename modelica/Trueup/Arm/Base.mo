within Trueup.Arm;
type Base = enumeration(
    free "it floats",
    fixed "it stays where it begins, whatever force that takes; there may be gravity")
  "What becomes of the base";
