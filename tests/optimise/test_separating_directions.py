"""Which directions keep pairs apart: what is chosen leaves the clearance wherever any direction does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as in_numpy

from designer.optics.clearance import LEG_DIRECTIONS, LEG_NORMALS, SOLID_DIRECTIONS, SOLID_NORMALS, normal_weights
from designer.optimise.problem import ConstraintEvaluation
from designer.optimise.separating_directions import (
    COMFORTABLE_MM,
    FAR,
    FAR_SHARE_OF_ENVELOPE,
    SeparatingDirections,
    choose_directions,
    normals_of,
    rechoose_directions,
)

CLEARANCE, ENVELOPE = 0.5, 200.0
REACH = FAR_SHARE_OF_ENVELOPE * ENVELOPE + CLEARANCE
# (directions, pairs, designs), in mm: overlapping, near and far.
quarters = st.integers(-36, 200).map(lambda number: number / 4)
separations = in_numpy.arrays(float, st.tuples(st.just(5), st.just(3), st.integers(1, 6)), elements=quarters)
choices = st.lists(
    st.tuples(st.tuples(*[st.integers(FAR, 4)] * 3), st.tuples(*[st.integers(FAR, 4)] * 2)).map(
        lambda pair: SeparatingDirections(*pair)
    ),
    min_size=1,
    max_size=5,
)


def evaluated(light: np.ndarray, bodies: np.ndarray) -> ConstraintEvaluation:
    none = np.zeros((0, light.shape[2]))
    return ConstraintEvaluation((), (), none, none, light, bodies)


@given(separations)
@settings(max_examples=40)
def test_a_chosen_direction_serves_wherever_one_does(light):
    """Far pairs are those that no design of all brings near."""
    for numbers, chosen in (
        (light, [choice.legs for choice in choose_directions(evaluated(light, -light), CLEARANCE, ENVELOPE)]),
        (-light, [choice.solids for choice in choose_directions(evaluated(light, -light), CLEARANCE, ENVELOPE)]),
    ):
        assert len(chosen) == light.shape[2]
        for pair in range(light.shape[1]):
            best = numbers[:, pair].max(axis=0)
            assert {choice[pair] == FAR for choice in chosen} == {bool(best.min() >= REACH)}
            for design, choice in enumerate(chosen):
                if choice[pair] != FAR:
                    kept = numbers[choice[pair], pair, design]
                    assert kept == best[design] or kept >= CLEARANCE + COMFORTABLE_MM


def test_what_serves_most_designs_is_taken_wherever_it_serves():
    """Two directions; the first is the better one for one design, and good enough for all but the last."""
    spare = np.array([[[9.0, 3.0, 4.0, 0.2]], [[1.0, 8.0, 9.0, 7.0]]])
    light = spare + CLEARANCE
    found = choose_directions(evaluated(light, light), CLEARANCE, ENVELOPE)
    # The second serves all four, by a comfortable millimetre at the least.
    assert [choice.legs for choice in found] == [(1,), (1,), (1,), (1,)]
    light[1, 0, 0] -= 0.1
    found = choose_directions(evaluated(light, light), CLEARANCE, ENVELOPE)
    assert [choice.legs for choice in found] == [(0,), (0,), (0,), (1,)]


@pytest.mark.parametrize(
    ("violation", "expected"),
    [
        # Pairs: room to spare; at its clearance, with a better direction; the same, with none; far and still so.
        (0.0, (0, 1, 0, FAR)),
        # Where the design fails by 0.2, a pair that lacks less than that does not hold it.
        (0.2, (0, 0, 0, FAR)),
    ],
)
def test_only_pairs_that_hold_the_design_change_direction(violation, expected):
    held = SeparatingDirections((0, 0, 0, FAR), ())
    spare = np.array([[3.0, 0.0, 0.0, 40.0], [9.0, 2.0, -1.0, 2.0]])
    light = spare[:, :, None] + CLEARANCE
    found = rechoose_directions(held, evaluated(light, np.zeros((2, 0, 1))), CLEARANCE, violation)
    assert found.legs == expected


def test_a_far_pair_that_came_too_near_gets_its_best_direction():
    light = np.array([[-3.0], [-0.25], [-2.0]])[:, :, None] + CLEARANCE
    far = SeparatingDirections((FAR,), (FAR,))
    found = rechoose_directions(far, evaluated(light, light), CLEARANCE, 0.2)
    assert found == SeparatingDirections((1,), (1,))
    assert rechoose_directions(far, evaluated(light, light), CLEARANCE, 0.3) == far


def test_a_failing_pair_changes_only_to_a_better_direction():
    held = SeparatingDirections((0, 0, 1), (2,))
    light = np.array([[-1.0, -0.5, -0.4], [-0.3, -0.9, -0.4], [-2.0, -3.0, -0.4]])[:, :, None] + CLEARANCE
    bodies = np.array([[4.0], [0.1], [-0.5]])[:, :, None] + CLEARANCE
    found = rechoose_directions(held, evaluated(light, bodies), CLEARANCE, 0.1)
    assert found == SeparatingDirections((1, 0, 1), (0,))


@given(choices)
def test_a_program_is_given_the_normal_of_each_pairs_own_direction(several):
    for choice in several:
        given_normals = normals_of(choice)
        of_legs = given_normals[: len(choice.legs) * (len(LEG_NORMALS) + 2)].reshape(len(choice.legs), -1)
        of_solids = given_normals[of_legs.size :].reshape(len(choice.solids), -1)
        for chosen, found, names, normals in (
            (choice.legs, of_legs, LEG_DIRECTIONS, LEG_NORMALS),
            (choice.solids, of_solids, SOLID_DIRECTIONS, SOLID_NORMALS),
        ):
            for direction, weights in zip(chosen, found, strict=True):
                expected = [0.0] * len(weights) if direction == FAR else normal_weights([names[direction]], normals)[0]
                assert weights.tolist() == list(expected)
