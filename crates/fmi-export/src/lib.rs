//! A hybrid model as FMI 2.0 and 3.0 functions.
