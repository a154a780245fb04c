"""The staged first walk: amplitude about the standing pose, and how it grows."""

import pytest

from w2b_hw.gait_scale import GROWTH_PER_S, GaitScale

CENTRE, POSE = (0.1, -0.2), (0.5, 0.6)


@pytest.mark.parametrize('asked', [0.0, 0.25, 1.0])
def test_it_begins_as_it_was_asked_for(asked):
    scaled = GaitScale(CENTRE).scaled(POSE, asked, 100.0)
    assert scaled == pytest.approx((0.1 + asked * 0.4, -0.2 + asked * 0.8))


def test_the_whole_gait_is_passed_on_to_the_bit():
    pose = (0.1 + 0.2, 1 / 3)
    assert GaitScale(CENTRE).scaled(pose, 1.0, 0.0) is pose


def test_it_grows_slowly_and_shrinks_at_once():
    scale, seen = GaitScale((0.0,)), []
    scale.scaled((1.0,), 0.0, 10.0)
    for frame in range(1, 61):
        seen.append(scale.scaled((1.0,), 1.0, 10.0 + 0.05 * frame)[0])
    steps = [after - before for before, after in zip([0.0, *seen], seen, strict=False)]
    assert max(steps) == pytest.approx(0.05 * GROWTH_PER_S)
    assert min(steps) >= 0.0
    assert seen[38] < 1.0 <= seen[40]
    assert scale.scaled((1.0,), 0.2, 13.05) == (0.2,)


def test_a_time_without_targets_is_growth_too_but_never_beyond_what_is_asked():
    scale = GaitScale((0.0,))
    scale.scaled((1.0,), 0.0, 0.0)
    assert scale.scaled((1.0,), 0.4, 60.0) == (0.4,)
