"""Genes as strings of bits: binary and Gray code, 5 to 16 bits, in machine words and packed.

A chromosome is the strings of its genes one after the other, most significant bits first. While it
evolves, whole genes stand in 64-bit words, the first gene on top and unused bits zero: crossover and
mutation are then a few operations on words. Populations are arrays of shape (n_words, m). In a
snapshot the strings follow each other without gaps.
Linear decoding as in Kim & Khosla (1992), section 3: v = lower + (upper - lower) u / (2**bits - 1).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel

Words = NDArray[np.uint64]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_WORD_BITS = 64


class Layout(NamedTuple):
    """Where the bits of a chromosome stand.

    Attributes:
        n_genes: Number of genes.
        bits: Bits of a gene.
    """

    n_genes: int
    bits: int

    @property
    def n_bits(self) -> int:
        """Number of bits of a chromosome."""
        return self.n_genes * self.bits

    @property
    def genes_per_word(self) -> int:
        """Number of genes in a word."""
        return _WORD_BITS // self.bits

    @property
    def n_words(self) -> int:
        """Number of words of a chromosome."""
        return -(-self.n_genes // self.genes_per_word)

    def places(self) -> Words:
        """Return word (row 0) and mask (row 1) of every bit, of shape (2, n_bits)."""
        gene, bit = np.divmod(np.arange(self.n_bits), self.bits)
        word, place = np.divmod(gene, self.genes_per_word)
        shift = (self.genes_per_word - 1 - place) * self.bits + self.bits - 1 - bit
        return np.array([word, np.uint64(1) << shift.astype(np.uint64)], np.uint64)

    def used(self) -> Words:
        """Return the masks of the bits in use, of shape (n_words,)."""
        masks = np.zeros(self.n_words, np.uint64)
        for word, mask in self.places().T:
            masks[word] |= mask
        return masks


@device
def gray_to_number(string: int) -> int:
    """Return the whole number below 2**16 that a Gray code string stands for."""
    string ^= string >> 8
    string ^= string >> 4
    string ^= string >> 2
    return string ^ (string >> 1)


@kernel
def decode(
    strings: Words,
    bits: int,
    gray: bool,
    lower: Floats,
    step: Floats,
    free: Integers,
    genes: Floats,
) -> None:
    """Decode k populations.

    Args:
        strings: Strings of the free genes, of shape (k, n_words, m).
        bits: Bits of a gene.
        gray: Whether they are Gray code.
        lower: Smallest values of all genes, of shape (k, n_genes).
        step: Distance of neighbouring values, of shape (k, n_genes).
        free: Indices of the genes that strings stand for, of shape (n_free,).
        genes: Receives the values of the free genes, of shape (k, n_genes, m).
    """
    per_word, mask = 64 // bits, (1 << bits) - 1
    for i in range(len(strings)):
        for g in range(len(free)):
            words, gene = strings[i, g // per_word], genes[i, free[g]]
            start, size = lower[i, free[g]], step[i, free[g]]
            shift = np.uint64((per_word - 1 - g % per_word) * bits)
            for j in range(len(words)):
                number = int(np.int32(np.int32(words[j] >> shift) & np.int32(mask)))
                if gray:
                    number = gray_to_number(number)
                gene[j] = start + size * number


def gene_steps(lower: Floats, upper: Floats, bits: int) -> Floats:
    """Return the distances of neighbouring values of genes of so many bits."""
    return (upper - lower) / float(2**bits - 1)


def pack(strings: Words, layout: Layout) -> NDArray[np.uint8]:
    """Pack populations for a snapshot.

    Args:
        strings: Strings, of shape (k, n_words, m).
        layout: Where their bits stand.

    Returns:
        Chromosomes, each beginning at a byte, of shape (k, m, ceil(n_bits / 8)).
    """
    word, mask = layout.places()
    spread = strings[:, word.astype(np.intp)] & mask[:, None] != 0
    return np.packbits(spread.transpose(0, 2, 1), axis=2)


def unpack(packed: NDArray[np.uint8], layout: Layout) -> Words:
    """Return the strings, of shape (k, n_words, m), that ``pack`` packed."""
    spread = np.unpackbits(packed, axis=2, count=layout.n_bits).transpose(0, 2, 1)
    strings = np.zeros((len(packed), layout.n_words, packed.shape[1]), np.uint64)
    for place, (word, mask) in enumerate(layout.places().T):
        strings[:, word] |= spread[:, place] * mask
    return strings
