"""Local derivatives of one call into the matrices of sparsity.py.

Indices are read as unsigned: that spares the loops numba's test for negative ones.
"""

from dms_core.assembly.pattern.sparsity import BlockPattern, NewtonPattern, Part, RatePattern
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import fields, indices, inner, ints, matrix, naturals
from dms_core.compiled.jit import compiled

PART, NEWTON, RATES, BLOCKS = fields(Part), fields(NewtonPattern), fields(RatePattern), fields(BlockPattern)


@compiled
def scatter_part(part, e, local, factor, values):
    """values[slot] += factor local[i, j] for the entries of call e."""
    ptr = ints(part, PART.ptr)
    first, end = ptr[e], ptr[e + 1]
    if first < end:
        i, j, slot = naturals(part, PART.i), naturals(part, PART.j), naturals(part, PART.slot)
        for k in range(first, end):
            values[slot[k]] += factor * local[i[k], j[k]]


@compiled
def begin_newton(pattern, values):
    """Values zero but for r1, which is linear."""
    values[:] = 0.0
    minus, plus = indices(pattern, NEWTON.minus), indices(pattern, NEWTON.plus)
    for i in range(minus.shape[0]):
        values[minus[i]] -= 1.0
        values[plus[i]] += 1.0


@compiled
def scatter_dynamic(pattern, e, w, h, values):
    """The local derivatives of dynamic call e into the Newton matrix."""
    scatter_part(inner(pattern, NEWTON.Jq), e, matrix(w, WORK.Jq), h * h, values)
    scatter_part(inner(pattern, NEWTON.Jv), e, matrix(w, WORK.Jv), h, values)
    scatter_part(inner(pattern, NEWTON.Ja), e, matrix(w, WORK.Ja), 1.0, values)


@compiled
def scatter_constraint(pattern, e, w, h, values):
    """The local derivatives of constraint call e into the Newton matrix."""
    G = matrix(w, WORK.G)
    scatter_part(inner(pattern, NEWTON.G_mu), e, G, -1.0, values)
    scatter_part(inner(pattern, NEWTON.G_lam), e, G, 1.0, values)
    scatter_part(inner(pattern, NEWTON.G_q), e, G, 1.0, values)
    scatter_part(inner(pattern, NEWTON.G_v), e, G, 1.0, values)
    scatter_part(inner(pattern, NEWTON.W), e, matrix(w, WORK.W), h, values)
    scatter_part(inner(pattern, NEWTON.H), e, matrix(w, WORK.H), h * h, values)


@compiled
def scatter_dynamic_rates(pattern, e, w, values):
    """The local derivatives of dynamic call e into the matrix of the acceleration problem."""
    scatter_part(inner(pattern, RATES.Jv), e, matrix(w, WORK.Jv), 1.0, values)
    scatter_part(inner(pattern, RATES.Ja), e, matrix(w, WORK.Ja), 1.0, values)


@compiled
def scatter_constraint_rates(pattern, e, w, values):
    """The local derivatives of constraint call e into the matrix of the acceleration problem."""
    G = matrix(w, WORK.G)
    scatter_part(inner(pattern, RATES.G_lam), e, G, 1.0, values)
    scatter_part(inner(pattern, RATES.G_v), e, G, 1.0, values)


@compiled
def scatter_dynamic_blocks(pattern, e, w, by_q, by_v, by_a):
    """The local derivatives of dynamic call e into r2_q, r2_v, r2_a."""
    scatter_part(inner(pattern, BLOCKS.Jq), e, matrix(w, WORK.Jq), 1.0, by_q)
    scatter_part(inner(pattern, BLOCKS.Jv), e, matrix(w, WORK.Jv), 1.0, by_v)
    scatter_part(inner(pattern, BLOCKS.Ja), e, matrix(w, WORK.Ja), 1.0, by_a)


@compiled
def scatter_constraint_blocks(pattern, e, w, by_q, G, W):
    """The local derivatives of constraint call e into r2_q, phi_q, (phi_q v)_q."""
    scatter_part(inner(pattern, BLOCKS.H), e, matrix(w, WORK.H), 1.0, by_q)
    scatter_part(inner(pattern, BLOCKS.G), e, matrix(w, WORK.G), 1.0, G)
    scatter_part(inner(pattern, BLOCKS.W), e, matrix(w, WORK.W), 1.0, W)


@compiled
def scatter_projection_block(pattern, e, w, by_q):
    """H of constraint call e, evaluated with mu in place of lam, into (phi_q^T mu)_q."""
    scatter_part(inner(pattern, BLOCKS.H_mu), e, matrix(w, WORK.H), 1.0, by_q)
