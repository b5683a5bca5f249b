"""Feet that leave deep prints before the source's do, and a walk that sinks too deep to wade, on a closed-form walk."""

from types import SimpleNamespace

import numpy as np
import pytest

from softground_addon.core.composers.responses import DEEP_FOR_A_WALK, CharacterResponse, response_findings
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response.leaving import LEAVE_TIME, leaving_early
from softground_addon.core.response.response import GroundingOptions, gaps, respond
from tests.core.legs.test_grounding import LEG, RATE, walk


def prints_of(motion, touching, depth):
    """The print of each contact."""
    return [
        SimpleNamespace(
            character=motion.name,
            sole=sole.sole.name,
            start_frame=motion.frames[first] - 0.3,
            end_frame=motion.frames[end - 1] + 0.3,
            max_depth_m=depth,
        )
        for number, sole in enumerate(motion.soles)
        for first, end in zip(*runs(touching[:, number]), strict=True)
    ]


def standing(depth):
    motion, touching = walk()
    return touching, leaving_early(motion, touching, prints_of(motion, touching, depth))


def test_a_foot_leaves_a_deep_print_early_while_the_other_one_stands():
    touching, stands = standing(0.35)
    early = touching & ~stands
    assert early.any(axis=0).all()
    assert not (stands & ~touching).any()
    assert (stands.any(axis=1) == touching.any(axis=1)).all(), "somebody always stands who stood"
    for number in range(2):
        for first, end in zip(*runs(early[:, number]), strict=True):
            assert end - first <= round(LEAVE_TIME * RATE)
            assert touching[first:end, 1 - number].all()
            assert not touching[end, number], "it does not come down again"


def test_a_foot_stays_in_a_shallow_print_until_it_leaves_in_the_source():
    touching, stands = standing(0.09)
    assert np.array_equal(stands, touching)


def test_prints_of_others_do_not_count():
    motion, touching = walk()
    others = prints_of(motion, touching, 0.35)
    for mark in others:
        mark.character = "somebody else"
    assert np.array_equal(leaving_early(motion, touching, others), touching)


@pytest.mark.parametrize(("legs", "codes"), [(0.95, []), (1.05, ["deep_for_this_walk"])])
def test_a_walk_that_sinks_too_deep_to_wade_is_named_with_a_remedy(legs, codes):
    motion, touching = walk()
    floor = GroundHistory(FlatTerrain(0.0))
    response = respond(motion, touching, floor, tilt=None, grounding=GroundingOptions())
    remaining = gaps(motion, touching, floor)
    depth = legs * DEEP_FOR_A_WALK * LEG
    findings = response_findings([CharacterResponse(motion, response, remaining, remaining, depth)])
    assert [finding.code for finding in findings] == codes
    for finding in findings:
        assert f"'{motion.name}' sinks {100 * depth:.0f} cm" in finding.message
        assert finding.remedy
