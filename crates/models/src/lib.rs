//! Dynamics and control laws; no FMI, no I/O.
