"""Where SIMD values live: arrays on the stack, lanes of numpy arrays, and per-lane noise."""

from __future__ import annotations

import operator
from collections import namedtuple
from math import prod
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

from w2b_sim.engines.batched.simd import I32, I64, Local, Vec

GOLDEN_RATIO_32 = 0x9E3779B9


def _allocate(layout: Any, sizes: tuple[Any, ...]) -> Any:
    if not all(isinstance(size, types.IntegerLiteral) for size in sizes):
        return None
    shape = tuple(int(size.literal_value) for size in sizes)
    vec = Vec(layout.layout.bits, layout.layout.lanes)

    def generate(_context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
        block = cgutils.alloca_once(builder, ir.ArrayType(vec.ir, max(1, prod(shape))))
        return builder.bitcast(block, vec.ir.as_pointer())
    return Local(vec, shape)(layout, *sizes), generate


@intrinsic
def local1(_context: Any, layout: Any, size: Any) -> Any:
    """Return an uninitialised stack array of `size` Vecs; the size is a literal."""
    return _allocate(layout, (size,))


@intrinsic
def local2(_context: Any, layout: Any, rows: Any, columns: Any) -> Any:
    """Return an uninitialised stack array of `rows` x `columns` Vecs; the sizes are literals."""
    return _allocate(layout, (rows, columns))


def structure(name: str, shapes: dict[str, tuple[int | str, ...]]) -> Any:
    """
    Return a named tuple class of stack arrays, for `allocate`.

    A size is a number or the name of a Layout's attribute.
    """
    made = namedtuple(name, shapes)  # type: ignore[misc]
    made.shapes = shapes  # type: ignore[attr-defined]
    return made


@intrinsic
def allocate(_context: Any, layout: Any, of: Any) -> Any:
    """
    Return uninitialised stack arrays as the fields of a `structure`.

    As an intrinsic this becomes part of the calling function, on whose stack the arrays live;
    a function of its own would return arrays that end with it.
    """
    made = of.instance_class
    vec = Vec(layout.layout.bits, layout.layout.lanes)
    locals_ = [Local(vec, tuple(
        getattr(layout.layout, size) if isinstance(size, str) else size for size in shape))
        for shape in made.shapes.values()]
    result = types.BaseTuple.from_types(locals_, made)

    def generate(context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
        pointers = []
        for local in locals_:
            count = max(1, prod(local.shape))
            block = cgutils.alloca_once(builder, ir.ArrayType(vec.ir, count))
            pointers.append(builder.bitcast(block, vec.ir.as_pointer()))
        return context.make_tuple(builder, result, pointers)
    return result(layout, of), generate


def _address(context: Any, builder: Any, local: Local, pointer: Any, index_type: Any,
             index: Any) -> Any:
    if isinstance(index_type, types.BaseTuple):
        parts = [context.cast(builder, builder.extract_value(index, position), part, types.int64)
                 for position, part in enumerate(index_type)]
        place = parts[0]
        for size, part in zip(local.shape[1:], parts[1:], strict=True):
            place = builder.add(builder.mul(place, ir.Constant(I64, size)), part)
    else:
        place = context.cast(builder, index, index_type, types.int64)
    return builder.gep(pointer, [place], inbounds=True)


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        return signature(args[0].vec, *args) if isinstance(args[0], Local) else None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        if not isinstance(args[0], Local):
            return None
        return signature(types.none, args[0], args[1], args[0].vec)


@lower_builtin(operator.getitem, Local, types.Any)
def _load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_address(context, builder, sig.args[0], args[0], sig.args[1], args[1]))


@lower_builtin(operator.setitem, Local, types.Any, Vec)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2],
                  _address(context, builder, sig.args[0], args[0], sig.args[1], args[1]))
    return context.get_dummy_value()


@intrinsic
def row(_context: Any, array: Any, index: Any) -> Any:
    """Return a view of one row of a two-dimensional stack array."""
    columns = array.shape[1]

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        place = context.cast(builder, values[1], sig.args[1], types.int64)
        return builder.gep(values[0], [builder.mul(place, ir.Constant(I64, columns))],
                           inbounds=True)
    return Local(array.vec, (columns,))(array, index), generate


@intrinsic
def set_lane(_context: Any, array: Any, index: Any, lane: Any, number: Any) -> Any:
    """Write `number` into one lane of one element of a one-dimensional stack array."""
    vec = array.vec

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        place = context.cast(builder, values[1], sig.args[1], types.int64)
        offset = context.cast(builder, values[2], sig.args[2], types.int64)
        flat = builder.add(builder.mul(place, ir.Constant(I64, vec.lanes)), offset)
        numbers = builder.bitcast(values[0], vec.element.as_pointer())
        builder.store(values[3], builder.gep(numbers, [flat], inbounds=True))
        return context.get_dummy_value()
    return types.none(array, index, lane, vec.number), generate


@intrinsic
def get_lane(_context: Any, array: Any, index: Any, lane: Any) -> Any:
    """Return one lane of one element of a one-dimensional stack array, as a number."""
    vec = array.vec

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        place = context.cast(builder, values[1], sig.args[1], types.int64)
        offset = context.cast(builder, values[2], sig.args[2], types.int64)
        flat = builder.add(builder.mul(place, ir.Constant(I64, vec.lanes)), offset)
        numbers = builder.bitcast(values[0], vec.element.as_pointer())
        return builder.load(builder.gep(numbers, [flat], inbounds=True))
    return vec.number(array, index, lane), generate


@intrinsic
def noise(_context: Any, layout: Any, seeds: Any, first: Any, counter: Any) -> Any:
    """
    Return a number in -1..1, uniform and new for every counter, from each lane's own seed.

    `seeds` is a view of uint32 numbers, the lanes' from `first` on. Counter-based: seed and
    counter go through a 32-bit integer mixer (xor-shift and multiply, twice), so a lane's noise
    does not depend on what the other lanes do, and is the same in both precisions (24 bits).
    """
    vec = Vec(layout.layout.bits, layout.layout.lanes)
    lanes = ir.VectorType(I32, vec.lanes)

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        def constant(number: int) -> Any:
            return ir.Constant(lanes, [number] * vec.lanes)

        data = cgutils.create_struct_proxy(sig.args[1])(context, builder, value=values[1]).data
        place = builder.gep(data, [values[2]], inbounds=True)
        x = builder.load(builder.bitcast(place, lanes.as_pointer()), align=4)
        count = builder.trunc(values[3], I32)
        one = builder.insert_element(ir.Constant(lanes, ir.Undefined), count,
                                     ir.Constant(I32, 0))
        counts = builder.shuffle_vector(one, one, ir.Constant(lanes, [0] * vec.lanes))
        x = builder.add(x, builder.mul(counts, constant(GOLDEN_RATIO_32)))
        for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 0x7FEB352D), (15, 1)):
            x = builder.xor(x, builder.lshr(x, constant(shift)))
            x = builder.mul(x, constant(factor))
        fraction = builder.uitofp(builder.lshr(x, constant(8)), vec.ir)
        scale = ir.Constant(vec.ir, [2.0**-23] * vec.lanes)
        return builder.fsub(builder.fmul(fraction, scale), ir.Constant(vec.ir, [1.0] * vec.lanes))
    return vec(layout, seeds, types.int64, types.int64), generate
