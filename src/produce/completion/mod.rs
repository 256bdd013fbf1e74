//! Shape-completion pairs: a partial and a complete occupancy grid of one view (thesis ch. 5).
