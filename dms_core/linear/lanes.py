"""Eight neighbouring numbers at once: the three vector operations of the factorisation and the solves.

numba turns plain loops into vector code only where it can prove that two parts of one array do not overlap, which it
cannot for blocks found by index. These few lines of LLVM say it. Each operation is, in scalar words,

    subtract(x, i, y, j, f)           for k in range(8): x[i + k] -= f * y[j + k]
    eliminate(a, i, j, lane, f)       for k in range(8): a[i + k] -= f * a[j + k] if k > lane;  then a[i + lane] = f
    dot(x, i, y, j)                   sum(x[i + k] * y[j + k] for k in range(8))

which is also what a target without these instructions (a GPU) would compile. LLVM splits a vector that is wider than
the processor's. Indices are uint64; nothing is checked against the array's length.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WIDTH = 8
"""Numbers in a block: one cache line of 64 bytes."""

_NUMBER = ir.DoubleType()
_BLOCK = ir.VectorType(_NUMBER, WIDTH)
_INDEX = ir.IntType(64)
_LANES = ir.Constant(ir.VectorType(_INDEX, WIDTH), [ir.Constant(_INDEX, k) for k in range(WIDTH)])
_FUSED = ("contract",)


def _pointer(context, builder, array_type, array, offset):
    """Address of the block that starts at an offset of a one-dimensional array."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [offset]), _BLOCK.as_pointer())


def _load(builder, pointer):
    """A block; arrays are only sure to be aligned to one number."""
    block = builder.load(pointer)
    block.align = 8
    return block


def _everywhere(builder, value, kind):
    """The same value in all lanes."""
    vector = ir.VectorType(kind, WIDTH)
    none, first = ir.Constant(vector, ir.Undefined), ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(none, value, first)
    return builder.shuffle_vector(one, none, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _minus_product(builder, x, f, y):
    """x - f y, fused where the processor can."""
    return builder.fsub(x, builder.fmul(f, y, flags=_FUSED), flags=_FUSED)


@intrinsic
def subtract(typingctx, x, i, y, j, f):
    """x[i : i + 8] -= f * y[j : j + 8]."""
    signature = types.void(x, types.uint64, y, types.uint64, types.float64)

    def codegen(context, builder, sig, args):
        target = _pointer(context, builder, sig.args[0], args[0], args[1])
        source = _pointer(context, builder, sig.args[2], args[2], args[3])
        factor = _everywhere(builder, args[4], _NUMBER)
        result = _minus_product(builder, _load(builder, target), factor, _load(builder, source))
        builder.store(result, target, align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def eliminate(typingctx, a, i, j, lane, f):
    """a[i : i + 8] -= f * a[j : j + 8] in the lanes beyond `lane`; f itself goes into that lane."""
    signature = types.void(a, types.uint64, types.uint64, types.uint64, types.float64)

    def codegen(context, builder, sig, args):
        target = _pointer(context, builder, sig.args[0], args[0], args[1])
        source = _pointer(context, builder, sig.args[0], args[0], args[2])
        lane, factor = _everywhere(builder, args[3], _INDEX), _everywhere(builder, args[4], _NUMBER)
        x = _load(builder, target)
        new = _minus_product(builder, x, factor, _load(builder, source))
        kept = builder.select(builder.icmp_unsigned(">", _LANES, lane), new, x)
        result = builder.select(builder.icmp_unsigned("==", _LANES, lane), factor, kept)
        builder.store(result, target, align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def dot(typingctx, x, i, y, j):
    """Scalar product of x[i : i + 8] and y[j : j + 8], summed in a fixed order."""
    signature = types.float64(x, types.uint64, y, types.uint64)

    def codegen(context, builder, sig, args):
        left = _load(builder, _pointer(context, builder, sig.args[0], args[0], args[1]))
        right = _load(builder, _pointer(context, builder, sig.args[2], args[2], args[3]))
        kind = ir.FunctionType(_NUMBER, [_NUMBER, _BLOCK])
        total = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.fadd.v{WIDTH}f64")
        product = builder.fmul(left, right)
        return builder.call(total, [ir.Constant(_NUMBER, -0.0), product], fastmath=("reassoc",))

    return signature, codegen
