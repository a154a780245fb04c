"""
What the compiled code is specialised for: precision, lanes and the sizes of a body.

They are in the *type* of a `Layout` value, so they are constants to the compiler, and one source
serves all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import (
    NativeValue,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)


@dataclass(frozen=True)
class Layout:
    """
    What the compiled code is specialised for.

    Attributes
    ----------
    bits, lanes
        Of a Vec: 32 or 64 bits a number, one number a lane.
    links, contacts, hidden, sensors, touches
        Sizes: links (the base included), points that can touch the floor, hidden neurons, sensor
        neurons, links with a touch sensor. There are `links - 1` joints and motor neurons.
    dynamic, chain
        Joints whose rate is an unknown of the solve because their servo may saturate, and how many
        of them at most move one link.
    coulomb
        1 for the contact solve with Coulomb's bound, 0 for the original's unbounded viscous one.
    leaky
        1 for commanded leaky networks, 0 for the original's primed ones.
    records
        1 for the call that records every frame (`recording_kernel`), 0 for `kernel`.

    """

    bits: int
    lanes: int
    links: int
    contacts: int
    hidden: int
    sensors: int
    touches: int
    dynamic: int
    chain: int
    coulomb: int
    leaky: int = 0
    records: int = 0

    @property
    def joints(self) -> int:
        """Joints, motor neurons."""
        return self.links - 1

    @property
    def inputs(self) -> int:
        """Sources that a hidden neuron hears while the body moves."""
        return self.hidden + self.sensors

    @property
    def priming_synapses(self) -> int:
        """Synapses that take part in priming."""
        return self.hidden * (self.hidden + 1)

    @property
    def hidden_synapses(self) -> int:
        """Synapses onto hidden neurons while the body moves."""
        return self.hidden * self.inputs

    @property
    def motor_synapses(self) -> int:
        """Synapses onto motor neurons."""
        return self.joints * self.motor_inputs

    @property
    def motor_inputs(self) -> int:
        """Sources that a motor neuron hears: a leaky network's hear the sensors, too."""
        return self.inputs if self.leaky else self.hidden

    @property
    def unknowns(self) -> int:
        """Unknown velocities of the solve: the base's six and the dynamic joints' rates."""
        return 6 + self.dynamic

    @property
    def slots(self) -> int:
        """Entries of a full vector over the unknowns, see `tree`."""
        return self.unknowns + 1

    @property
    def width(self) -> int:
        """Entries of a vector that belongs to one link, see `tree`."""
        return self.chain + 6

    @property
    def rows(self) -> int:
        """Rows with an impulse of their own: normals and motors."""
        return self.contacts + self.dynamic

    @property
    def contact_pairs(self) -> int:
        """Pairs of contacts, each of which answers to an impulse at the other."""
        return self.contacts**2

    @property
    def outcomes(self) -> int:
        """Numbers that come out of an evaluation, see `kernel.Log`."""
        return 8 + self.touches


class LayoutType(types.Type):
    """The numba type of a Layout: its values are part of the type."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        super().__init__(str(layout))


@register_model(LayoutType)
class _LayoutModel(models.OpaqueModel):
    pass


@typeof_impl.register(Layout)
def _typeof_layout(value: Layout, _context: Any) -> LayoutType:
    return LayoutType(value)


@unbox(LayoutType)
def _unbox_layout(_type: Any, _object: Any, context: Any) -> NativeValue:
    return NativeValue(context.context.get_dummy_value())


@infer_getattr
class _LayoutAttributes(AttributeTemplate):
    key = LayoutType

    def generic_resolve(self, layout: LayoutType, name: str) -> types.Type | None:
        value = getattr(layout.layout, name, None)
        return types.literal(value) if isinstance(value, int) else None


@lower_getattr_generic(LayoutType)
def _get_layout_attribute(_context: Any, _builder: Any, layout: LayoutType, _value: Any,
                          name: str) -> Any:
    return ir.Constant(ir.IntType(64), getattr(layout.layout, name))
