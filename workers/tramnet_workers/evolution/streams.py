"""What random numbers are drawn for: part of the key of each stream.

Two draws for different purposes never share a word, so that changing how many numbers one operator
takes changes nothing for the others. A number, once given, is never given another meaning.
"""

from enum import IntEnum


class Purpose(IntEnum):
    """Purpose of a random stream, 0 to 2**32 - 1."""

    INITIAL = 1  # slot: individual
    SELECTION = 2  # slot: place among the parents
    CROSSOVER = 3  # slot: pair
    DESTRUCTION = 4  # slot: individual
    POSITION = 5  # slot: individual
    REPLACEMENT = 6  # slot: individual
    MATING = 7  # slot: couple
    MUTATION = 8  # slot: child
    BIT_MUTATION = 9  # slot: 0
    FIRST_STEPS = 10  # slot: individual
    COUPLES = 11  # slot: couple
    MUTATED_STEPS = 12  # slot: child
