"""Everything that is computed on a node: robots, fitness and evolution."""
