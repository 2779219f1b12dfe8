"""Tries in shares: in the order of their rows, none done twice, each told of once."""

from agents.evaluation.search.shared_tries import SharedTries
from agents.evaluation.search.tries import Try


def squared(policy, rows, power):
    return [Try(policy, row, {"return": row["x"] ** power}) for row in rows]


def shuffled_out(sizes):
    """Does shares, the last first, and notes how many rows each has."""

    def share_out(work, shares):
        for share in reversed(shares):
            sizes.append(len(share[1]))
            yield work(*share)

    return share_out


def test_what_is_known_is_not_done_again_and_rows_keep_their_order():
    sizes, told = [], []
    shared = SharedTries(squared, "pid", (2,), 2, shuffled_out(sizes), told.append)
    shared.know([Try("pid", {"x": 3.0}, {"return": -1.0})])
    found = shared.at([{"x": float(x)} for x in (5, 3, 1, 4)])
    assert [one.measures["return"] for one in found] == [25.0, -1.0, 1.0, 16.0]
    assert sizes == [1, 2] and [one.numbers["x"] for one in told] == [4.0, 5.0, 1.0]
    assert shared.at([{"x": 4.0}, {"x": 5.0}])[1] is found[0] and sizes == [1, 2]
