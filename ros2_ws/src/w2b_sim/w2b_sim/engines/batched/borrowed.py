"""
Borrowed views of numpy arrays, and small integer lists, for the inside of the compiled call.

numba counts references to arrays wherever they are passed or sliced, with calls that evict all
vector registers. A `View` is a bare pointer with its inner sizes: the arrays belong to the caller
of the compiled call, who keeps them alive.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature,
)
from numba.extending import intrinsic, lower_builtin, lower_getattr, models, register_model

from w2b_sim.engines.batched.simd import I64

DIMENSIONS = 3


class View(types.Type):
    """A C-contiguous array of numbers that the caller owns. Indices are not checked."""

    def __init__(self, number: types.Type, dimensions: int) -> None:
        self.number, self.dimensions = number, dimensions
        super().__init__(f'View({number}, {dimensions})')


class Integers(types.Type):
    """A list of integers on the stack, of a size known to the compiler."""

    def __init__(self, size: int) -> None:
        self.size = size
        super().__init__(f'Integers({size})')


@register_model(View)
class _ViewModel(models.StructModel):
    def __init__(self, dmm: Any, fe: View) -> None:
        super().__init__(dmm, fe, [('data', types.CPointer(fe.number)),
                                   ('shape', types.UniTuple(types.int64, DIMENSIONS))])


@register_model(Integers)
class _IntegersModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe: Integers) -> None:
        super().__init__(dmm, fe, I64.as_pointer())


@intrinsic
def borrow(_context: Any, arrays: Any) -> Any:
    """Return a named tuple with Views in place of its arrays; what is no array stays."""
    fields = [View(field.dtype, field.ndim) if isinstance(field, types.Array) else field
              for field in arrays.types]
    result = types.BaseTuple.from_types(fields, arrays.instance_class)

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        parts = []
        for position, (source, view) in enumerate(zip(sig.args[0].types, fields, strict=True)):
            value = builder.extract_value(values[0], position)
            if isinstance(source, types.Array):
                array = context.make_array(source)(context, builder, value)
                made = cgutils.create_struct_proxy(view)(context, builder)
                made.data = array.data
                sizes = cgutils.unpack_tuple(builder, array.shape)
                sizes += [ir.Constant(I64, 1)] * (DIMENSIONS - len(sizes))
                made.shape = cgutils.pack_array(builder, sizes)
                value = made._getvalue()
            parts.append(value)
        return context.make_tuple(builder, result, parts)
    return result(arrays), generate


@infer_getattr
class _ViewAttributes(AttributeTemplate):
    key = View

    def resolve_shape(self, _view: View) -> types.Type:
        return types.UniTuple(types.int64, DIMENSIONS)


@lower_getattr(View, 'shape')
def _shape(context: Any, builder: Any, view: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(view)(context, builder, value=value).shape


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        if isinstance(args[0], View):
            return signature(args[0].number, *args)
        return signature(types.int64, *args) if isinstance(args[0], Integers) else None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        if isinstance(args[0], View):
            return signature(types.none, args[0], args[1], args[0].number)
        if isinstance(args[0], Integers):
            return signature(types.none, args[0], args[1], types.int64)
        return None


def _address(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    view, index_type = sig.args[:2]
    proxy = cgutils.create_struct_proxy(view)(context, builder, value=args[0])
    sizes = cgutils.unpack_tuple(builder, proxy.shape)
    if isinstance(index_type, types.BaseTuple):
        parts = [context.cast(builder, builder.extract_value(args[1], position), part,
                              types.int64) for position, part in enumerate(index_type)]
    else:
        parts = [context.cast(builder, args[1], index_type, types.int64)]
    if len(parts) != view.dimensions:
        raise TypeError(f'{view}: {len(parts)} indices')
    place = parts[0]
    for size, part in zip(sizes[1:], parts[1:], strict=False):
        place = builder.add(builder.mul(place, size), part)
    return builder.gep(proxy.data, [place], inbounds=True)


@lower_builtin(operator.getitem, View, types.Any)
def _load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_address(context, builder, sig, args))


@lower_builtin(operator.setitem, View, types.Any, types.Any)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value = context.cast(builder, args[2], sig.args[2], sig.args[0].number)
    builder.store(value, _address(context, builder, sig, args))
    return context.get_dummy_value()


@intrinsic
def integers(_context: Any, _layout: Any, size: Any) -> Any:
    """Return an uninitialised list of integers; the size is a literal."""
    if not isinstance(size, types.IntegerLiteral):
        return None
    count = int(size.literal_value)

    def generate(_context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
        block = cgutils.alloca_once(builder, ir.ArrayType(I64, max(1, count)))
        return builder.bitcast(block, I64.as_pointer())
    return Integers(count)(_layout, size), generate


@lower_builtin(operator.getitem, Integers, types.Any)
def _load_integer(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    place = context.cast(builder, args[1], sig.args[1], types.int64)
    return builder.load(builder.gep(args[0], [place], inbounds=True))


@lower_builtin(operator.setitem, Integers, types.Any, types.int64)
def _store_integer(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    place = context.cast(builder, args[1], sig.args[1], types.int64)
    builder.store(args[2], builder.gep(args[0], [place], inbounds=True))
    return context.get_dummy_value()
