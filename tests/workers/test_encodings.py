import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tramnet_workers.evolution import scaling
from tramnet_workers.evolution.encodings import Layout, decode, gene_steps, pack, unpack

BITS = st.integers(5, 16)


def numbers(strings, bits, gray):
    """Decode one gene into the whole numbers 0 ... 2**bits - 1."""
    words = strings.astype(np.uint64) << np.uint64((64 // bits - 1) * bits)
    genes = np.empty((1, 1, len(strings)))
    lower, upper = np.zeros((1, 1)), np.full((1, 1), 2.0**bits - 1)
    step = gene_steps(lower, upper, bits)
    decode(words[None, None], bits, gray, lower, step, np.zeros(1, np.int64), genes)
    return genes[0, 0]


def random_strings(rng, layout, k, m):
    words = rng.integers(0, 2**64, (k, layout.n_words, m), dtype=np.uint64)
    return words & layout.used()[:, None]


@pytest.mark.parametrize("gray", [False, True])
@pytest.mark.parametrize("bits", [5, 10, 16])
def test_every_string_stands_for_a_number_of_its_own(bits, gray):
    found = numbers(np.arange(2**bits), bits, gray)

    assert sorted(found) == list(range(2**bits))


def test_plain_binary_strings_are_the_numbers_themselves():
    assert list(numbers(np.arange(32), 5, gray=False)) == list(range(32))


@pytest.mark.parametrize("bits", [5, 10, 16])
def test_neighbouring_numbers_differ_in_one_gray_bit(bits):
    string_of = np.argsort(numbers(np.arange(2**bits), bits, gray=True))

    changed = string_of[:-1] ^ string_of[1:]

    assert np.all(np.bitwise_count(changed) == 1)


def test_gray_code_of_the_first_eight_numbers_is_that_of_the_textbook():
    textbook = [0b000, 0b001, 0b011, 0b010, 0b110, 0b111, 0b101, 0b100]

    assert list(numbers(np.array(textbook), 5, gray=True)) == list(range(8))


@given(BITS, st.floats(-5, 5), st.floats(0.01, 5))
def test_a_gene_runs_from_its_lower_to_its_upper_limit(bits, lower, width):
    low, high = np.full((1, 1), lower), np.full((1, 1), lower + width)
    ends = np.array([[[0, 2**64 - 1]]], np.uint64)
    genes = np.empty((1, 1, 2))

    decode(ends, bits, False, low, gene_steps(low, high, bits), np.zeros(1, np.int64), genes)

    assert genes[0, 0, 0] == lower
    assert genes[0, 0, 1] == pytest.approx(lower + width, abs=1e-12)


def test_given_genes_are_left_alone():
    genes = np.full((1, 3, 4), 7.0)
    lower, upper = np.array([[0.0, 7.0, 0.0]]), np.array([[1.0, 7.0, 1.0]])
    step, free = gene_steps(lower, upper, 8), np.array([0, 2])

    decode(np.zeros((1, 1, 4), np.uint64), 8, True, lower, step, free, genes)

    assert np.all(genes[0, 1] == 7.0)
    assert np.all(genes[0, [0, 2]] == 0.0)


@given(BITS, st.integers(1, 40))
def test_every_bit_of_a_chromosome_has_a_place_of_its_own(bits, n_genes):
    layout = Layout(n_genes, bits)

    word, mask = layout.places()

    assert np.all(np.bitwise_count(mask) == 1)
    assert len(set(zip(word.tolist(), mask.tolist(), strict=True))) == layout.n_bits
    assert word.max() == layout.n_words - 1
    assert np.bitwise_count(layout.used()).sum() == layout.n_bits


@given(BITS, st.integers(1, 3), st.integers(1, 9), st.integers(1, 7), st.randoms())
def test_packed_populations_unpack_to_themselves(bits, k, n_genes, m, random):
    layout = Layout(n_genes, bits)
    strings = random_strings(np.random.default_rng(random.getrandbits(32)), layout, k, m)

    packed = pack(strings, layout)

    assert packed.shape == (k, m, -(-n_genes * bits // 8))
    assert np.array_equal(unpack(packed, layout), strings)


def test_a_hundred_chromosomes_of_forty_bits_take_five_hundred_bytes():
    assert pack(np.zeros((1, 1, 100), np.uint64), Layout(4, 10)).nbytes == 500


def test_the_first_gene_s_most_significant_bit_is_packed_first():
    strings = np.array([[[1 << 59 | 1 << 40]]], np.uint64)  # six genes of ten bits a word

    assert pack(strings, Layout(2, 10)).tolist() == [[[0b10000000, 0b00000000, 0b00010000]]]


FITNESS = hnp.arrays(np.float64, st.integers(2, 40), elements=st.floats(-100, 100, width=32))


@given(FITNESS)
def test_shifted_shares_are_never_negative_and_keep_all_differences(fitness):
    shares = np.empty_like(fitness)

    scaling.shift(fitness, shares)

    assert shares.min() == 0.0
    assert np.allclose(shares - shares[0], fitness - fitness[0], atol=1e-4)


@given(FITNESS)
def test_scaled_shares_have_mean_one_and_give_the_best_at_most_two(fitness):
    shares = np.empty_like(fitness)

    scaling.scale(fitness, shares)

    assert shares.min() >= 0.0
    assert shares.mean() == pytest.approx(1.0)
    assert shares.max() <= 2.0 + 1e-9


def test_goldberg_s_scaling_gives_the_best_twice_the_mean_where_it_can():
    shares = np.empty(4)

    scaling.scale(np.array([1.0, 1.2, 1.4, 2.0]), shares)

    assert shares.max() == pytest.approx(2.0)
    assert shares.min() > 0.0


def test_one_bad_individual_does_not_flatten_scaled_shares_to_zero_spread():
    fitness = np.array([1.0, 1.1, 1.2, -1000.0])
    shares = np.empty(4)

    scaling.scale(fitness, shares)

    assert shares[3] == 0.0
    assert shares[:3] == pytest.approx(4.0 / 3.0, abs=1e-3)


@given(FITNESS, st.floats(0, 1, exclude_max=True))
def test_the_wheel_stops_where_the_accumulated_shares_pass_the_pointer(fitness, u):
    shares, wheel = np.empty_like(fitness), np.empty_like(fitness)
    scaling.shift(fitness, shares)
    scaling.accumulate(shares, wheel)

    found = scaling.spin(wheel, u)

    sector = np.searchsorted(wheel, u * wheel[-1], side="right")
    assert found == min(sector, len(wheel) - 1)


def test_equal_shares_of_nothing_get_equal_sectors():
    wheel = np.empty(4)

    scaling.accumulate(np.zeros(4), wheel)

    assert [scaling.spin(wheel, u) for u in (0.1, 0.3, 0.6, 0.9)] == [0, 1, 2, 3]
