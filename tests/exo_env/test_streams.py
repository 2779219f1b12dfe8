"""The counter-based streams against published vectors, NumPy-independent quantiles, and what they are for."""

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import kstest

from exo_env.streams import block, fill_normals, normal_quantile, philox, stream, streams, uniform, uniforms

# Known answers of philox4x32 with ten rounds, from kat_vectors of the Random123 library.
KNOWN = (
    ([0] * 4, [0] * 2, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ([0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344], [0xA4093822, 0x299F31D0], "d16cfe09 94fdcceb 5001e420 24126ea1"),
)
KEY = np.uint64(2**63 + 12345)


@pytest.mark.parametrize(("counter", "key", "wanted"), KNOWN)
def test_known_answers(counter, key, wanted):
    found = philox(*(np.uint64(x) for x in [*counter, *key]))
    assert " ".join(f"{int(x):08x}" for x in found) == wanted


def test_quantiles_of_the_normal_distribution():
    p = np.concatenate([np.logspace(-10, -0.31, 2000), np.linspace(0.49, 0.51, 501), 1.0 - np.logspace(-9, -0.31, 500)])
    found = np.array([normal_quantile(x) for x in p])
    # The published coefficients give 16 digits where they are used for all but one number in 1e11.
    np.testing.assert_allclose(found, ndtri(p), rtol=3e-15, atol=1e-16)
    far = np.logspace(-16, -10, 200)
    # Beyond that they give 12: a hundred-millionth of what a single-precision observation can show.
    np.testing.assert_allclose([normal_quantile(x) for x in far], ndtri(far), rtol=1e-12)


def test_numbers_are_uniform_and_normal():
    x = np.array([uniform(KEY, stream("load"), i) for i in range(20_000)])
    assert x.min() >= 0.0 and x.max() < 1.0
    # Fixed numbers, so no flake: a wrong shift or a repeated word gives p far below this.
    assert kstest(x, "uniform").pvalue > 0.01
    assert abs(np.corrcoef(x[:-1], x[1:])[0, 1]) < 0.03
    y = np.empty(20_001)
    fill_normals(KEY, stream("noise"), y)
    assert kstest(y, "norm").pvalue > 0.01 and np.isfinite(y).all()
    assert abs(np.corrcoef(y[::2][:10_000], y[1::2])[0, 1]) < 0.03


def test_the_largest_words_give_finite_numbers():
    whole = np.uint64(2**53 - 1)
    assert (float(whole >> np.uint64(1)) + 0.5) / 4503599627370496.0 < 1.0
    assert np.isfinite(normal_quantile((float(whole >> np.uint64(1)) + 0.5) / 4503599627370496.0))
    assert np.isfinite(normal_quantile(0.5 / 4503599627370496.0))


def test_streams_are_apart_by_key_and_by_name():
    names = streams(["height", "load", "a", "b"])
    assert len(set(names.tolist())) == 4
    out, other = np.empty(4), np.empty(4)
    uniforms(KEY, names, out)
    uniforms(KEY + np.uint64(1), names, other)
    assert len({*out, *other}) == 8
    alone = np.empty(1)
    uniforms(KEY, names[2:3], alone)
    assert alone[0] == out[2]
    # All 64 bits of the key and of the name count.
    assert block(KEY, names[0], 0) != block(KEY ^ np.uint64(2**63), names[0], 0)
    assert block(KEY, names[0], 0) != block(KEY, names[0] ^ np.uint64(2**63), 0)
