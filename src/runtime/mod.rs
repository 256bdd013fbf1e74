//! What a robot or a trainer links: dataset readers; no simulator.
