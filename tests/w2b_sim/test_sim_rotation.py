"""Vectors turned into a body's frame agree with PyBullet's rotation matrices."""

import numpy as np
import pybullet
from hypothesis import given
from hypothesis import strategies as st

from w2b_sim.rotation import into_body

angles = st.floats(-3.1, 3.1)
components = st.floats(-10.0, 10.0)


@given(st.tuples(angles, angles, angles), st.tuples(components, components, components))
def test_it_is_the_transposed_rotation_matrix(euler, vector):
    quaternion = np.array(pybullet.getQuaternionFromEuler(euler))
    matrix = np.array(pybullet.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
    assert np.allclose(into_body(quaternion, np.array(vector)), matrix.T @ vector, atol=1e-9)
