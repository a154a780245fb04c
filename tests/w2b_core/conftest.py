"""The shipped words and ear, for all tests of this folder."""

import pytest

from tests.w2b_core import legs_controller
from w2b_core.vocabulary import Vocabulary


@pytest.fixture(scope='module')
def vocabulary():
    return Vocabulary.load()


@pytest.fixture(scope='module')
def ear():
    return legs_controller.ear()
