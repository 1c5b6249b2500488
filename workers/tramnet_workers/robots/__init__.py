"""Robots as numbers: serial arms, the published PUMA 560 data and the bridge to Pinocchio."""
