"""Which contact solve a layout has: chosen while compiling, so that only that one is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.extending import overload

from w2b_sim.engines.batched.algebra import INLINED
from w2b_sim.engines.batched.coulomb import solve_coulomb
from w2b_sim.engines.batched.coulomb_tree import solve_coulomb_tree
from w2b_sim.engines.batched.layout import LayoutType
from w2b_sim.engines.batched.viscous import solve_viscous
from w2b_sim.engines.batched.viscous_tree import solve_viscous_tree


def solve_contacts(layout, tables, state, frame, composite, contacts, solve, near, count, clock,
                   erp_per_h, slip, friction):
    """
    Solve for the velocities of one step by the layout's friction law; they end in solve.y.

    `slip` is h / slip for the viscous law and slip / h for Coulomb's. `contacts` is scratch of the
    solves for bodies without dynamic joints, `solve` of those with.
    """
    raise NotImplementedError('compiled code only')


@overload(solve_contacts, jit_options=INLINED, strict=False)
def _choose(layout: LayoutType, *_types: Any) -> Callable[..., None]:
    def coulomb(layout, tables, state, frame, composite, contacts, solve, near, count, clock,
                erp_per_h, slip, friction):
        solve_coulomb(layout, state, frame, composite, contacts, near, count, erp_per_h, slip,
                      friction, clock.second_sweeps, clock.reach, clock.per_gap, solve.y)

    def viscous(layout, tables, state, frame, composite, contacts, solve, near, count, clock,
                erp_per_h, slip, friction):
        solve_viscous(layout, state, frame, composite, contacts, near, count, erp_per_h, slip,
                      clock.first_sweeps, clock.second_sweeps, solve.y)

    def coulomb_tree(layout, tables, state, frame, composite, contacts, solve, near, count, clock,
                     erp_per_h, slip, friction):
        solve_coulomb_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                           slip, friction, clock.h, clock.second_sweeps, clock.reach,
                           clock.per_gap)

    def viscous_tree(layout, tables, state, frame, composite, contacts, solve, near, count, clock,
                     erp_per_h, slip, friction):
        solve_viscous_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                           slip, clock.h, clock.first_sweeps, clock.second_sweeps)
    if layout.layout.dynamic:
        return coulomb_tree if layout.layout.coulomb else viscous_tree
    return coulomb if layout.layout.coulomb else viscous
