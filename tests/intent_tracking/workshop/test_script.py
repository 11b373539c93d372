"""A rehearsed demonstration obeys what its truth says."""

import numpy as np
import pytest

from intent_perception.geometry.transforms import inverse, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.workshop.person.acting.script import Act, Scenario, Script, rehearse
from intent_tracking.workshop.person.acting.task_moves import Pace
from intent_tracking.workshop.person.body.person_hand import sample_hand
from intent_tracking.workshop.person.body.skin import Skin, make_skin
from intent_tracking.workshop.person.filming.film import CAMERA, all_seen, film, in_view, sample_set

pytestmark = pytest.mark.slow

_SCENARIO = Scenario("left", (Act("bottle_0", "pouring"),), ("glass_0", "ball"), "left")


@pytest.fixture(scope="module")
def played() -> tuple[Script, Skin]:
    rng = np.random.default_rng(21)
    skin = make_skin(sample_hand(rng, "left"), 0.0035)
    models = {m.name: m for m in (*ObjectDatabase.load(), *ObjectDatabase.clutter())}
    return rehearse(_SCENARIO, models, skin, rng), skin


def test_nothing_moves_before_the_grasp_and_others_never(played: tuple[Script, Skin]) -> None:
    script, _ = played
    before = script.objects[: script.grasp_frames[0]]
    assert np.allclose(before, before[0])
    assert np.allclose(script.objects[:, 1:], script.objects[0, 1:])
    assert script.objects[-1, 0, 2, 3] > script.objects[0, 0, 2, 3] + 0.05


def test_the_held_object_stays_where_the_truth_says_in_the_hand(
    played: tuple[Script, Skin],
) -> None:
    script, _ = played
    first = script.grasp_frames[0]
    held = inverse(script.objects[first:, 0]) @ script.hands[first:]
    assert np.allclose(held, script.grips[0], atol=2e-3)
    assert np.allclose(script.angles[first:], script.angles[first])


def test_skin_touches_the_object_between_touch_and_end_and_not_before(
    played: tuple[Script, Skin],
) -> None:
    script, skin = played
    distances = []
    for frame in (script.touch_frames[0] - 2, script.grasp_frames[0], len(script.hands) - 1):
        T_object_hand = inverse(script.objects[frame, 0]) @ script.hands[frame]
        points = transform_points(T_object_hand, skin.posed(script.angles[frame]))
        corners = script.models[0].mesh.sample_surface(4000, np.random.default_rng(0))[0]
        gap = np.linalg.norm(points[::7, None] - corners[None], axis=2).min()
        distances.append(gap)
    assert distances[0] > 0.001
    assert max(distances[1:]) < 0.003


def test_nobody_moves_faster_than_a_person(played: tuple[Script, Skin]) -> None:
    script, _ = played
    step = np.linalg.norm(np.diff(script.hands[:, :3, 3], axis=0), axis=1)
    bend = np.abs(np.diff(script.angles, axis=0))
    assert step.max() < 0.045
    assert bend.max() < 0.6
    assert 60 <= len(script.hands) <= 150
    assert Pace().hold >= 10


def test_the_film_shows_an_empty_table_first_and_the_left_hand_later(
    played: tuple[Script, Skin],
) -> None:
    script, skin = played
    rng = np.random.default_rng(2)
    scene = next(
        s for s in (sample_set(rng, script.edge) for _ in range(30)) if all_seen(script, s)
    )
    shots = film(script, skin, scene, rng)
    first = next(shots)
    assert not first.hand_in_view
    assert first.frame.depth.shape == (480, 640)
    assert (first.visible > 300).all()
    T_camera_table = inverse(scene.T_table_camera)
    grasp = script.grasp_frames[0]
    joints = transform_points(script.hands[grasp], skin.hand.joint_positions(script.angles[grasp]))
    seen = transform_points(T_camera_table, joints)
    assert in_view(seen, np.full((480, 640), 5.0, np.float32))
    assert not in_view(seen, np.full((480, 640), 0.2, np.float32))
    assert CAMERA.project(seen).shape == (21, 2)
