//! Gait simulator.
