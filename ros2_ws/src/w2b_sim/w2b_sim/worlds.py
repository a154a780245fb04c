"""The worlds that bodies move in: gravity, contact and the two clocks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class World:
    """
    Attributes
    ----------
    gravity_m_s2
        Along z, so negative.
    control_period_s
        Between two sensor frames.
    physics_steps
        Physics steps in one control period.
    friction
        Coulomb's coefficient; None for unbounded friction.
    slip_m_per_n_s
        Force-dependent slip (ODE's slip1, slip2): tangential velocity = -slip * force, which makes
        friction viscous; 0 for none.
    erp
        Error reduction: the share of a penetration that one physics step removes.
    steps
        Control periods of one evaluation.

    """

    name: str
    gravity_m_s2: float
    control_period_s: float
    physics_steps: int
    friction: float | None
    slip_m_per_n_s: float
    erp: float
    steps: int

    @property
    def physics_step_s(self) -> float:
        """Length of one physics step."""
        return self.control_period_s / self.physics_steps


#: The original study's world. Its program uses gravity of -1 m/s^2, which the paper does not say.
PAPER = World('paper', gravity_m_s2=-1.0, control_period_s=0.05, physics_steps=1, friction=None,
              slip_m_per_n_s=0.01, erp=0.2, steps=500)

#: The physical robot's world: 10 s of ordinary gravity and dry friction.
EARTH = World('earth', gravity_m_s2=-9.81, control_period_s=0.05, physics_steps=50, friction=0.8,
              slip_m_per_n_s=0.0, erp=0.2, steps=200)

WORLDS = {world.name: world for world in (PAPER, EARTH)}
