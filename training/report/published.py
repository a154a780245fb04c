"""
What the paper published: its tables, and what its text says of its figures.

Source: "Word2vec to behavior: morphology facilitates the grounding of language in machines" (IROS
2019), Tables I to III, section III and the captions of figures 4 to 6. The heights of the figures'
bars are not printed in it.
"""

from __future__ import annotations

from typing import NamedTuple

#: Commands in the order of Tables I and II.
COMMANDS = ('forward', 'backward', 'halt', 'stop', 'suspend', 'cease')

#: Table I: cosines of the embedding's vectors, rows of the upper triangle.
COSINES = ((0.42, 0.15, 0.13, 0.11, 0.02), (0.17, 0.17, 0.09, -0.01), (0.61, 0.63, 0.56),
           (0.38, 0.50), (0.57,))

#: Table II: a sample of the same after each vector was permuted.
PERMUTED_COSINES = ((0.03, 0.06, 0.05, 0.04, -0.05), (0.09, -0.01, -0.00, -0.00),
                    (-0.02, 0.11, -0.05), (0.04, -0.01), (-0.04,))


class Fitness(NamedTuple):
    """A row of Table III: medians and 'standard deviations', control and word2vec."""

    control: float
    control_sd: float
    word2vec: float
    word2vec_sd: float
    significant: bool


#: Table III: training performance, in metres; significance at 0.05.
FITNESS = {
    'quadruped': Fitness(1.84, 0.07, 1.90, 0.49, False),
    'minimal': Fitness(5.30, 0.06, 5.43, 0.07, False),
    'spherical_1dof_sensors': Fitness(10.74, 0.08, 11.22, 0.08, True),
    'spherical_1dof_blind': Fitness(11.48, 0.08, 11.20, 0.09, False),
    'spherical_2dof_sensors': Fitness(10.55, 0.08, 10.84, 0.08, False),
    'spherical_2dof_blind': Fitness(10.61, 0.09, 10.33, 0.07, False),
}

#: The bodies of the paper in the order of Table III, and how figures name bodies.
TITLES = {
    'quadruped': 'Quadruped',
    'minimal': 'Minimal',
    'spherical_1dof_sensors': '1DOF sphere with sensors',
    'spherical_1dof_blind': '1DOF sphere without sensors',
    'spherical_2dof_sensors': '2DOF sphere with sensors',
    'spherical_2dof_blind': '2DOF sphere without sensors',
}

#: Levels of significance: of the claims about displacement, and of Table III.
ALPHA, ALPHA_FITNESS = 0.01, 0.05
RUNS_AN_ARM = 100
GENERATIONS = 6000
COMPARISONS = 56


def title(word_set: str, body: str) -> str:
    """Return how figures and tables name a panel."""
    name = TITLES.get(body, body.replace('_', ' '))
    return name if word_set == 'paper' else f'{name}, {word_set} set'
