"""Genes as strings of bits: binary and Gray code, 5 to 16 bits, and packed for the wire.

A gene is one ``uint16`` that holds its string of bits; a chromosome is the strings of its genes one
after the other, most significant bits first. Populations are arrays of shape (n_genes, m).
Linear decoding as in Kim & Khosla (1992), section 3: v = lower + (upper - lower) u / (2**bits - 1).
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel

Strings = NDArray[np.uint16]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@device
def gray_to_number(string: int) -> int:
    """Return the whole number below 2**16 that a Gray code string stands for."""
    string ^= string >> 8
    string ^= string >> 4
    string ^= string >> 2
    return string ^ (string >> 1)


@kernel
def decode(
    strings: Strings, gray: bool, lower: Floats, step: Floats, free: Integers, genes: Floats
) -> None:
    """Decode k populations.

    Args:
        strings: Strings of the free genes, of shape (k, n_free, m).
        gray: Whether they are Gray code.
        lower: Smallest values of all genes, of shape (k, n_genes).
        step: Distance of neighbouring values, of shape (k, n_genes).
        free: Indices of the genes that strings stand for, of shape (n_free,).
        genes: Receives the values of the free genes, of shape (k, n_genes, m).
    """
    for i in range(len(strings)):
        for g in range(len(free)):
            string, gene = strings[i, g], genes[i, free[g]]
            start, size = lower[i, free[g]], step[i, free[g]]
            for j in range(len(string)):
                number = int(np.int32(string[j]))
                if gray:
                    number = gray_to_number(number)
                gene[j] = start + size * number


def gene_steps(lower: Floats, upper: Floats, bits: int) -> Floats:
    """Return the distances of neighbouring values of genes of so many bits."""
    return (upper - lower) / float(2**bits - 1)


def pack(strings: Strings, bits: int) -> NDArray[np.uint8]:
    """Pack populations for a snapshot.

    Args:
        strings: Strings, of shape (k, n_genes, m).
        bits: Bits of a gene.

    Returns:
        Chromosomes, each beginning at a byte, of shape (k, m, ceil(n_genes bits / 8)).
    """
    shifts = np.arange(bits - 1, -1, -1, dtype=np.uint16)
    spread = (strings.transpose(0, 2, 1)[..., None] >> shifts) & 1
    return np.packbits(spread.reshape(*spread.shape[:2], -1).astype(np.uint8), axis=2)


def unpack(packed: NDArray[np.uint8], n_genes: int, bits: int) -> Strings:
    """Return the strings, of shape (k, n_genes, m), that ``pack`` packed."""
    spread = np.unpackbits(packed, axis=2, count=n_genes * bits)
    spread = spread.reshape(*packed.shape[:2], n_genes, bits)
    powers = np.uint16(1) << np.arange(bits - 1, -1, -1, dtype=np.uint16)
    strings = (spread * powers).sum(axis=3, dtype=np.uint16)
    return np.ascontiguousarray(strings.transpose(0, 2, 1))
