"""Genetic operators as functions of arrays and keyed random streams."""
