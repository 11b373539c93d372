"""Skin, light and covers of the films of people."""

import cv2
import numpy as np
import pytest

from intent_perception.geometry.camera import KINECT
from intent_perception.geometry.transforms import inverse, look_at
from intent_tracking.workshop.people.casting import cast
from intent_tracking.workshop.person.body.dressed import gloved, with_folds
from intent_tracking.workshop.person.body.limb import bare_arm
from intent_tracking.workshop.person.body.other_hand import (
    OtherFlesh,
    sample_other_hand,
)
from intent_tracking.workshop.person.body.skin import GLOVE, REST, make_skin
from intent_tracking.workshop.person.filming.cover import COVERS, covered
from intent_tracking.workshop.person.filming.exposure import sample_exposure
from intent_tracking.workshop.person.filming.film import Set
from intent_tracking.workshop.person.filming.look import (
    monk_display,
    plain_look,
    skin_palette,
    watch,
)
from intent_tracking.workshop.person.filming.picture import picture
from intent_tracking.workshop.person.filming.room import Piece, block, sample_room
from intent_tracking.workshop.person.filming.viewpoint import (
    PLACEMENTS,
    rolled,
    sample_viewpoint,
)


def _lightness(tone: int) -> float:
    patch = (255.0 * monk_display(tone)).astype(np.uint8)[None, None]
    return float(cv2.cvtColor(patch, cv2.COLOR_RGB2LAB)[0, 0, 0])


def test_skin_tones_grow_darker_and_no_two_are_alike() -> None:
    lightness = np.array([_lightness(tone) for tone in range(1, 11)])
    assert np.all(lightness[2:] < lightness[:-2])  # the scale's tones 2 and 3 differ in hue
    colors = np.array([monk_display(tone) for tone in range(1, 11)])
    apart = np.linalg.norm(colors[:, None] - colors[None], axis=2) + np.eye(10)
    assert apart.min() > 0.02


def test_palms_of_dark_hands_are_much_lighter_than_their_backs() -> None:
    rng = np.random.default_rng(0)
    light, dark = skin_palette(2, rng), skin_palette(9, rng)
    assert dark[1].mean() > 1.5 * dark[0].mean()
    assert light[1].mean() < 1.1 * light[0].mean()


def test_an_unknown_tone_is_refused() -> None:
    with pytest.raises(ValueError, match="Monk tone"):
        monk_display(11)


def test_everything_new_about_a_set_is_off_by_default() -> None:
    scene = Set(np.eye(4), (), *3 * (None,))  # type: ignore[arg-type]
    assert scene.look is None
    assert scene.company is None
    assert scene.arm_in_lap
    color = np.array([0.8, 0.6, 0.5])
    plain = plain_look(color)
    assert np.array_equal(plain.palette[0], color)
    assert not plain.bare
    assert plain.things == ()


def test_an_over_exposed_hand_is_clipped_to_white_and_an_under_exposed_one_is_dark() -> None:
    rng = np.random.default_rng(1)
    skin = skin_palette(3, rng)[0]
    pose = look_at(np.array([0.0, -0.3, 0.6]), np.zeros(3))
    slab = Piece(block(np.zeros(3), np.array([0.3, 0.3, 0.02])), skin)
    shown = {
        kind: picture([slab], KINECT, pose, sample_exposure(kind, skin, rng)).color[
            200:280, 280:360
        ]
        for kind in ("over", "even", "under")
    }
    assert (shown["over"].min(axis=2) == 255).mean() > 0.5
    assert (shown["even"].min(axis=2) == 255).mean() < 0.1
    assert shown["under"].mean() < 140.0


def test_a_covered_table_is_flat_or_below_its_plane() -> None:
    rng = np.random.default_rng(2)
    room = tuple(sample_room(rng, 0.3))
    skin = np.array([0.5, 0.3, 0.2])
    assert covered(room, "plain", skin, rng) == room
    for kind in COVERS:
        top = covered(room, kind, skin, rng)[0].mesh.vertices[:, 2]
        assert -1e-9 < -top.max() + 1e-9 < 1e-6


def test_a_rolled_camera_looks_along_the_same_line() -> None:
    pose = sample_viewpoint("facing", 0.3, np.random.default_rng(3))
    turned = rolled(pose, np.pi)
    assert np.allclose(turned[:3, [2, 3]], pose[:3, [2, 3]])
    assert np.allclose(turned[:3, :2], -pose[:3, :2])


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_cameras_see_the_middle_of_the_table_from_a_reasonable_distance(placement: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        pose = sample_viewpoint(placement, 0.3, rng)
        middle = inverse(pose) @ [0.0, 0.04, 0.05, 1.0]
        assert 0.3 < middle[2] < 1.3
        assert np.linalg.norm(middle[:2]) < 0.3 * middle[2]


def test_a_hand_of_another_build_is_closed_and_encloses_its_bones() -> None:
    rng = np.random.default_rng(5)
    hand = sample_other_hand(rng)
    skin = make_skin(hand, 0.004, OtherFlesh(hand, rng))
    assert 4.0e-4 < skin.rest.volume < 14.0e-4
    joints = hand.joint_positions(REST)
    nearest = np.linalg.norm(skin.rest.vertices[:, None] - joints[None], axis=2).min(axis=0)
    assert nearest[[4, 8, 12, 16, 20]].max() < 0.005
    covered_skin = gloved(with_folds(skin))
    assert covered_skin.rest.volume > skin.rest.volume
    assert np.any(covered_skin.tones == GLOVE)
    assert len(watch(hand, rng)) == 2


def test_the_bare_arm_is_turned_outwards() -> None:
    hand = np.eye(4)
    arm = bare_arm(hand, np.array([-0.25, 0.02, 0.0]), np.array([-0.40, 0.02, 0.25]))
    assert arm.volume > 5.0e-4


def test_all_values_of_each_property_come_in_turn() -> None:
    casts = [cast(7, n) for n in range(60)]
    tones = [c.tone for c in casts]
    assert all(tones.count(str(tone)) == 6 for tone in range(1, 11))
    assert sum(c.objects == "none" for c in casts) == 15
    assert {c.placement for c in casts[:6]} == set(PLACEMENTS)
    assert casts[3] == cast(7, 3)
