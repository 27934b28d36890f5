"""What accuracy costs in time: benchmarks beside peers, and the cases that are hard to get right."""
