"""
Explicit SIMD values for numba: one number for each of L robots, computed in lockstep.

A `Vec` is an LLVM vector of L floats of 32 or 64 bits, so `a * b + 1` becomes plain vector
instructions and nothing hangs on the loop vectoriser. Every operation is strict IEEE arithmetic and
`fma` is explicit: a lane's bits depend on its own inputs alone, not on its neighbours, on the
number of lanes or on the machine's vector width.

A number that meets a Vec (`2.0 * x`, `mass[k] * x`) is computed in its own type and rounded once,
to the lanes' precision, where it meets the vector.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import (
    AbstractTemplate,
    infer_global,
    signature,
)
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

I32, I64 = ir.IntType(32), ir.IntType(64)


class Vec(types.Type):
    """L floats of 32 or 64 bits."""

    def __init__(self, bits: int, lanes: int) -> None:
        self.bits, self.lanes = bits, lanes
        super().__init__(f'Vec({lanes} x f{bits})')

    @property
    def element(self) -> ir.Type:
        """The LLVM type of one number."""
        return ir.FloatType() if self.bits == 32 else ir.DoubleType()

    @property
    def ir(self) -> ir.VectorType:
        """The LLVM type of the vector."""
        return ir.VectorType(self.element, self.lanes)

    @property
    def number(self) -> types.Float:
        """The numba type of one number."""
        return types.float32 if self.bits == 32 else types.float64

    @property
    def suffix(self) -> str:
        """The vector's part of the name of an LLVM intrinsic."""
        return f'v{self.lanes}f{self.bits}'


class Mask(types.Type):
    """L booleans."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        super().__init__(f'Mask({lanes})')


class Local(types.Type):
    """An array of Vec on the stack, of a shape known to the compiler."""

    def __init__(self, vec: Vec, shape: tuple[int, ...]) -> None:
        self.vec, self.shape = vec, shape
        super().__init__(f'Local({vec}, {shape})')


@register_model(Vec)
class _VecModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe: Vec) -> None:
        super().__init__(dmm, fe, fe.ir)


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe: Mask) -> None:
        super().__init__(dmm, fe, ir.VectorType(ir.IntType(1), fe.lanes))


@register_model(Local)
class _LocalModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe: Local) -> None:
        super().__init__(dmm, fe, fe.vec.ir.as_pointer())


# --- arithmetic

def _splat(builder: Any, vec: Vec, number: Any) -> Any:
    undefined = ir.Constant(vec.ir, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(I32, 0))
    return builder.shuffle_vector(one, undefined,
                                  ir.Constant(ir.VectorType(I32, vec.lanes), [0] * vec.lanes))


@lower_cast(types.Number, Vec)
def _broadcast(context: Any, builder: Any, source: Any, vec: Vec, value: Any) -> Any:
    return _splat(builder, vec, context.cast(builder, value, source, vec.number))


def _vec_among(args: tuple[types.Type, ...]) -> Vec | None:
    """Return the Vec type of a mix of Vecs of one type and numbers; None if it is another mix."""
    vecs = {arg for arg in args if isinstance(arg, Vec)}
    rest = [arg for arg in args if not isinstance(arg, Vec)]
    if len(vecs) != 1 or not all(isinstance(arg, types.Number) for arg in rest):
        return None
    return vecs.pop()


def _define_operator(key: Any, arity: int, instruction: Any, makes_mask: bool) -> None:
    @infer_global(key)
    class _Operator(AbstractTemplate):
        def generic(self, args: Any, _kws: Any) -> Any:
            vec = _vec_among(args)
            if vec is None or len(args) != arity:
                return None
            return signature(Mask(vec.lanes) if makes_mask else vec, *[vec] * arity)

    lower_builtin(key, *[Vec] * arity)(
        lambda _context, builder, _signature, args: instruction(builder, *args))


for _key, _name in ((operator.add, 'fadd'), (operator.sub, 'fsub'), (operator.mul, 'fmul'),
                    (operator.truediv, 'fdiv')):
    _define_operator(_key, 2, lambda b, x, y, name=_name: getattr(b, name)(x, y), False)
for _key, _sign in ((operator.lt, '<'), (operator.le, '<='), (operator.gt, '>'),
                    (operator.ge, '>='), (operator.eq, '==')):
    _define_operator(_key, 2, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y), True)
_define_operator(operator.neg, 1, lambda b, x: b.fneg(x), False)


def _select(sign: str, args: tuple[types.Type, ...]) -> Any:
    vec = _vec_among(args)

    def generate(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        return builder.select(builder.fcmp_ordered(sign, *values), *values)
    return (vec(vec, vec), generate) if vec else None


@intrinsic
def vmax(_context: Any, a: Any, b: Any) -> Any:
    """Return the larger, lane by lane; `b` where they are unordered."""
    return _select('>', (a, b))


@intrinsic
def vmin(_context: Any, a: Any, b: Any) -> Any:
    """Return the smaller, lane by lane; `b` where they are unordered."""
    return _select('<', (a, b))


@intrinsic
def where(_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return `a` in the lanes of `mask` and `b` in the others."""
    vec = _vec_among((a, b))
    if vec is None:
        return None
    return vec(mask, vec, vec), lambda _c, builder, _s, values: builder.select(*values)


def _call(name: str, result: ir.Type, arguments: list[ir.Type]) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(result, arguments), name)
        return builder.call(function, values)
    return generate


@intrinsic
def vsqrt(_context: Any, a: Any) -> Any:
    """Return the square root, correctly rounded."""
    return a(a), _call(f'llvm.sqrt.{a.suffix}', a.ir, [a.ir])


@intrinsic
def vround(_context: Any, a: Any) -> Any:
    """Return the nearest whole number, ties to even."""
    return a(a), _call(f'llvm.rint.{a.suffix}', a.ir, [a.ir])


@intrinsic
def vabs(_context: Any, a: Any) -> Any:
    """Return the magnitude."""
    return a(a), _call(f'llvm.fabs.{a.suffix}', a.ir, [a.ir])


@intrinsic
def fma(_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a * b + c, rounded once: the same bits on every machine."""
    vec = _vec_among((a, b, c))
    if vec is None:
        return None
    return vec(vec, vec, vec), _call(f'llvm.fma.{vec.suffix}', vec.ir, [vec.ir] * 3)


@intrinsic
def power_of_two(_context: Any, whole: Any) -> Any:
    """Return 2 ** whole, for whole numbers in the range of normal exponents."""
    width, bias, mantissa = (I32, 127, 23) if whole.bits == 32 else (I64, 1023, 52)
    integers = ir.VectorType(width, whole.lanes)

    def generate(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        def constant(number: int) -> Any:
            return ir.Constant(integers, [number] * whole.lanes)
        exponent = builder.add(builder.fptosi(values[0], integers), constant(bias))
        return builder.bitcast(builder.shl(exponent, constant(mantissa)), whole.ir)
    return whole(whole), generate


@intrinsic
def is_single(_context: Any, a: Any) -> Any:
    """Return whether the lanes are of 32 bits: a constant to the compiler."""
    return types.boolean(a), lambda _c, _b, _s, _v: ir.Constant(ir.IntType(1), int(a.bits == 32))


@intrinsic
def like(_context: Any, example: Any, number: Any) -> Any:
    """Return `number` in every lane of a Vec of the type of `example`."""
    return example(example, example), lambda _c, _b, _s, values: values[1]


@intrinsic
def splat(_context: Any, layout: Any, number: Any) -> Any:
    """Return `number` in every lane of a Vec of the layout's type."""
    vec = Vec(layout.layout.bits, layout.layout.lanes)
    return vec(layout, vec), lambda _c, _b, _s, values: values[1]


@intrinsic
def any_lane(_context: Any, mask: Any) -> Any:
    """Return whether a lane is true."""
    return types.boolean(mask), _call(f'llvm.vector.reduce.or.v{mask.lanes}i1', ir.IntType(1),
                                      [ir.VectorType(ir.IntType(1), mask.lanes)])


@intrinsic
def both(_context: Any, a: Any, b: Any) -> Any:
    """Return the lanes that are true in both masks."""
    return a(a, a), lambda _c, builder, _s, values: builder.and_(*values)
