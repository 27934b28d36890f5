"""A planner that chooses the next directions from what was measured so far."""
