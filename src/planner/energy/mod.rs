//! Energies that rank poses of a hand at an object that a camera saw in part.
