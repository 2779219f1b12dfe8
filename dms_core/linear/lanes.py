"""Eight neighbouring numbers at once: the three vector operations of the factorisation and the solves.

numba turns plain loops into vector code only where it can prove that two parts of one array do not overlap, which it
cannot for blocks found by index. These few lines of LLVM say it. Each operation is, in scalar words,

    subtract(x, i, y, j, f)           for k in range(8): x[i + k] -= f * y[j + k]
    eliminate(a, i, j, lane, f)       for k in range(8): a[i + k] -= f * a[j + k] if k > lane;  then a[i + lane] = f
    dot(x, i, y, j)                   sum(x[i + k] * y[j + k] for k in range(8))

which is also what a target without these instructions (a GPU) would compile. LLVM splits a vector that is wider than
the processor's. Indices are uint64; nothing is checked against the array's length.

Numbers are real or complex, as the arrays are. A block of complex ones is a vector of 16, real and imaginary parts in
turn; f y is then  Re f (y_r, y_i, ...) + Im f (-y_i, y_r, ...).
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WIDTH = 8
"""Numbers in a block: one cache line of 64 bytes."""

_NUMBER = ir.DoubleType()
_INDEX = ir.IntType(64)
_FUSED = ("contract",)


def _is_complex(array_type):
    """True for an array of complex numbers."""
    return array_type.dtype == types.complex128


def _vector(values, kind):
    """A constant vector."""
    return ir.Constant(ir.VectorType(kind, len(values)), [ir.Constant(kind, x) for x in values])


def _block(array_type):
    """Type of a block of the array."""
    return ir.VectorType(_NUMBER, 2 * WIDTH if _is_complex(array_type) else WIDTH)


def _pointer(context, builder, array_type, array, offset):
    """Address of the block that starts at an offset of a one-dimensional array."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [offset]), _block(array_type).as_pointer())


def _load(builder, pointer):
    """A block; arrays are only sure to be aligned to one number."""
    block = builder.load(pointer)
    block.align = 8
    return block


def _everywhere(builder, value, kind, width=WIDTH):
    """The same value in all places."""
    vector = ir.VectorType(kind, width)
    none, first = ir.Constant(vector, ir.Undefined), ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(none, value, first)
    return builder.shuffle_vector(one, none, _vector([0] * width, ir.IntType(32)))


def _shuffled(builder, x, order):
    """The numbers of x in another order."""
    return builder.shuffle_vector(x, x, _vector(order, ir.IntType(32)))


def _swapped(builder, y):
    """Imaginary parts in the places of real ones and the other way round."""
    return _shuffled(builder, y, [k ^ 1 for k in range(2 * WIDTH)])


def _factor(context, builder, array_type, f):
    """The factor f in all places: one vector for a real f, those of Re f and of Im f (signs -, +) for a complex one."""
    if not _is_complex(array_type):
        return (_everywhere(builder, f, _NUMBER),)
    number = context.make_complex(builder, types.complex128, value=f)
    re, im = (_everywhere(builder, x, _NUMBER, 2 * WIDTH) for x in (number.real, number.imag))
    return re, builder.fmul(im, _vector([-1.0, 1.0] * WIDTH, _NUMBER))


def _minus_product(builder, x, factor, y):
    """x - f y, fused where the processor can."""
    result = builder.fsub(x, builder.fmul(factor[0], y, flags=_FUSED), flags=_FUSED)
    if len(factor) == 1:
        return result
    crossed = builder.fmul(factor[1], _swapped(builder, y), flags=_FUSED)
    return builder.fsub(result, crossed, flags=_FUSED)


@intrinsic
def subtract(typingctx, x, i, y, j, f):
    """x[i : i + 8] -= f * y[j : j + 8]."""
    signature = types.void(x, types.uint64, y, types.uint64, x.dtype)

    def codegen(context, builder, sig, args):
        target = _pointer(context, builder, sig.args[0], args[0], args[1])
        source = _pointer(context, builder, sig.args[2], args[2], args[3])
        factor = _factor(context, builder, sig.args[0], args[4])
        result = _minus_product(builder, _load(builder, target), factor, _load(builder, source))
        builder.store(result, target, align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def eliminate(typingctx, a, i, j, lane, f):
    """a[i : i + 8] -= f * a[j : j + 8] in the lanes beyond `lane`; f itself goes into that lane."""
    signature = types.void(a, types.uint64, types.uint64, types.uint64, a.dtype)

    def codegen(context, builder, sig, args):
        parts = 2 if _is_complex(sig.args[0]) else 1
        lanes = _vector([k // parts for k in range(parts * WIDTH)], _INDEX)
        target = _pointer(context, builder, sig.args[0], args[0], args[1])
        source = _pointer(context, builder, sig.args[0], args[0], args[2])
        factor = _factor(context, builder, sig.args[0], args[4])
        lane = _everywhere(builder, args[3], _INDEX, parts * WIDTH)
        x = _load(builder, target)
        new = _minus_product(builder, x, factor, _load(builder, source))
        kept = builder.select(builder.icmp_unsigned(">", lanes, lane), new, x)
        own = factor[0]
        if parts == 2:
            # The real part in even places, the imaginary part in odd ones, where its sign is +.
            order = [k if k % 2 == 0 else 2 * WIDTH + k for k in range(2 * WIDTH)]
            own = builder.shuffle_vector(factor[0], factor[1], _vector(order, ir.IntType(32)))
        result = builder.select(builder.icmp_unsigned("==", lanes, lane), own, kept)
        builder.store(result, target, align=8)
        return context.get_dummy_value()

    return signature, codegen


def _sum(builder, product):
    """The sum of a vector, in a fixed order."""
    width = product.type.count
    kind = ir.FunctionType(_NUMBER, [_NUMBER, product.type])
    total = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.fadd.v{width}f64")
    return builder.call(total, [ir.Constant(_NUMBER, -0.0), product], fastmath=("reassoc",))


@intrinsic
def dot(typingctx, x, i, y, j):
    """Scalar product of x[i : i + 8] and y[j : j + 8], without conjugation, summed in a fixed order."""
    signature = x.dtype(x, types.uint64, y, types.uint64)

    def codegen(context, builder, sig, args):
        left = _load(builder, _pointer(context, builder, sig.args[0], args[0], args[1]))
        right = _load(builder, _pointer(context, builder, sig.args[2], args[2], args[3]))
        product = builder.fmul(left, right)
        if not _is_complex(sig.args[0]):
            return _sum(builder, product)
        number = context.make_complex(builder, types.complex128)
        number.real = _sum(builder, builder.fmul(product, _vector([1.0, -1.0] * WIDTH, _NUMBER)))
        number.imag = _sum(builder, builder.fmul(left, _swapped(builder, right)))
        return number._getvalue()

    return signature, codegen
