"""Film number n of a seed: a person of some kind before a camera somewhere, with the truth."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_perception.workshop.scenes.sensor_noise import KinectNoise
from intent_tracking.workshop.people.casting import Cast, cast
from intent_tracking.workshop.people.company_pieces import Gathering, passing_board
from intent_tracking.workshop.people.extras import bystander, second_hand
from intent_tracking.workshop.people.gestures import improvise
from intent_tracking.workshop.person.acting.person_grasp import Taker
from intent_tracking.workshop.person.acting.reaching import plan_reaches, preference
from intent_tracking.workshop.person.acting.script import (
    Act,
    Scenario,
    Script,
    enact,
    sample_body,
    sample_spots,
)
from intent_tracking.workshop.person.acting.task_moves import Pace
from intent_tracking.workshop.person.body.dressed import gloved, with_folds
from intent_tracking.workshop.person.body.felt_solid import graspable
from intent_tracking.workshop.person.body.other_hand import OtherFlesh, sample_other_hand
from intent_tracking.workshop.person.body.person_hand import sample_hand
from intent_tracking.workshop.person.body.skin import Skin, make_skin
from intent_tracking.workshop.person.filming.cover import covered, walled
from intent_tracking.workshop.person.filming.exposure import sample_exposure
from intent_tracking.workshop.person.filming.film import (
    CAMERA,
    Company,
    Set,
    Shot,
    film,
    person_pieces,
    wholly_in_view,
)
from intent_tracking.workshop.person.filming.look import WORN, Look, skin_palette
from intent_tracking.workshop.person.filming.room import Clothes, sample_clothes, sample_room
from intent_tracking.workshop.person.filming.viewpoint import (
    STEREO,
    STEREO_NOISE,
    STRUCTURED_NOISE,
    sample_viewpoint,
)

HIDDEN_FRAMES = 10
"""For so long something covers the hand."""
_PACE = Pace(reach=18, approach=7, close=6, hold=8, task=14)
_SPACING = 0.0035
_SENSORS = {"structured": (CAMERA, STRUCTURED_NOISE), "stereo": (STEREO, STEREO_NOISE)}
_ACTS = (("bottle", "pouring"), ("bottle", "hand-over"), ("glass", "pouring"), ("mug", "pouring"),
         ("mug", "hand-over"), ("hammer", "tool-use"), ("knife", "tool-use"),
         ("screwdriver", "hand-over"))  # fmt: skip

_GLOVES = np.array([[0.05, 0.10, 0.35], [0.75, 0.75, 0.72], [0.03, 0.03, 0.03],
                    [0.12, 0.30, 0.55], [0.60, 0.45, 0.10]])  # fmt: skip
"""RGB of gloves."""


@dataclass(frozen=True, eq=False)
class PeopleFilm:
    """Everything that one film needs to be shot."""

    number: int
    cast: Cast
    script: Script
    skin: Skin
    scene: Set
    noise: KinectNoise
    seed: int

    def shots(self) -> Iterator[Shot]:
        """Yield the frames with their truth; the same bits every time."""
        rng = np.random.default_rng([self.seed, self.number, 2])
        yield from film(self.script, self.skin, self.scene, rng, self.noise)

    @property
    def objects(self) -> RecognizedObjects:
        """The objects where they truly are, as a recogniser would report them; may be none."""
        items = tuple(
            RecognizedObject(model.name, model.name, model.object_class, pose, 1.0, 1.0)
            for model, pose in zip(self.script.models, self.script.objects[0], strict=True)
        )
        return RecognizedObjects(0, items, self.scene.T_table_camera)

    @property
    def models(self) -> dict[str, ObjectModel]:
        """The objects by name."""
        return {model.name: model for model in self.script.models}


def people_film(seed: int, number: int) -> PeopleFilm:
    """Return film `number` of a seed.

    Raises:
        ValueError: if the person can take none of twenty objects.
    """
    chosen = cast(seed, number)
    skin = _skin(chosen, np.random.default_rng([seed, number, 0]))
    for attempt in range(20):
        rng = np.random.default_rng([seed, number, 1, attempt])
        try:
            script = _script(chosen, skin, rng)
        except ValueError:  # no comfortable grasp: something else is taken
            continue
        scene = _set(chosen, script, skin, rng)
        shown = gloved(skin) if chosen.dress == "glove" else with_folds(skin)
        noise = _SENSORS[chosen.sensor][1]
        return PeopleFilm(number, chosen, script, shown, scene, noise, seed)
    raise ValueError(f"film {number} of seed {seed} cannot be shown")


@cache
def _database() -> dict[str, ObjectModel]:
    return {model.name: model for model in ObjectDatabase.load()}


def _skin(chosen: Cast, rng: np.random.Generator) -> Skin:
    if chosen.build == "usual":
        return make_skin(sample_hand(rng, chosen.side), _SPACING)
    hand = sample_other_hand(rng, chosen.side)
    return make_skin(hand, _SPACING, OtherFlesh(hand, rng))


def _script(chosen: Cast, skin: Skin, rng: np.random.Generator) -> Script:
    """Return what happens: something is taken, or there are only gestures."""
    body = sample_body(rng)
    if chosen.objects == "none":
        leaves = chosen.hidden == "once" and chosen.placement != "head"
        return improvise(body, chosen.side, body.edge, leaves, rng)
    kind, task = _ACTS[rng.integers(len(_ACTS))]
    models = _database()
    model = models[f"{kind}_{rng.integers(8)}"]
    others = rng.permutation([name for name in models if not name.startswith(kind)])
    other = tuple(str(name) for name in others[: rng.integers(0, 3)])
    scenario = Scenario("people", (Act(model.name, task),), other, chosen.side, pace=_PACE)
    taker = Taker(skin, graspable(model, 0.003), rng)
    spot = sample_spots(1, rng)[0]
    reaches = plan_reaches(taker, model, task, body, spot, rng, tries=24, enough=1)
    return enact(scenario, models, body, [taker], [min(reaches, key=preference)], rng)


def _set(chosen: Cast, script: Script, skin: Skin, rng: np.random.Generator) -> Set:
    """Return room, light, clothes and look, and a camera that sees the hand."""
    look = _look(chosen, skin, rng)
    back = look.palette[0]
    room = covered(tuple(sample_room(rng, script.edge)), chosen.cover, back, rng)
    room = walled(room, rng)
    scene = Set(
        np.eye(4), room, sample_exposure(chosen.exposure, back, rng), _clothes(chosen, look, rng),
        back, look, _SENSORS[chosen.sensor][0], arm_in_lap=chosen.company != "second hand",
    )  # fmt: skip
    scene = _seen_from(chosen, script, skin, scene, rng)
    return replace(scene, company=_company(chosen, script, skin, scene, rng))


def _look(chosen: Cast, skin: Skin, rng: np.random.Generator) -> Look:
    glove = _GLOVES[rng.integers(len(_GLOVES))]
    palette = (*skin_palette(int(chosen.tone), rng), glove)
    things = WORN[chosen.dress](skin.hand, rng) if chosen.dress in WORN else ()
    bare = chosen.dress == "bare arm" or (chosen.dress in WORN and rng.random() < 0.5)
    return Look(palette, things, bare)


def _clothes(chosen: Cast, look: Look, rng: np.random.Generator) -> Clothes:
    clothes = sample_clothes(rng)
    if look.bare:
        return replace(clothes, bare=0.0, width=0.051)
    if chosen.dress == "sleeve":
        return replace(clothes, bare=rng.uniform(-0.012, 0.010))
    return replace(clothes, bare=0.085) if chosen.dress == "watch" else clothes


def _seen_from(
    chosen: Cast, script: Script, skin: Skin, scene: Set, rng: np.random.Generator
) -> Set:
    """Return the scene from the first of some viewpoints that sees enough, or from the best."""
    best, most = scene, -1.0
    for _ in range(12):
        pose = sample_viewpoint(chosen.placement, script.edge, rng)
        trial = replace(scene, T_table_camera=pose)
        share = _share_in_view(script, skin, trial)
        if share > most:
            best, most = trial, share
        if most >= 0.6:
            break
    return best


def _share_in_view(script: Script, skin: Skin, scene: Set) -> float:
    """Return in which share of the frames after the first third the whole hand is seen."""
    T_camera_table, small = inverse(scene.T_table_camera), scene.camera.scaled(0.25)
    frames = range(len(script.hands) // 3, len(script.hands), 6)
    whole = 0
    for f in frames:
        meshes = [piece.mesh for piece in person_pieces(script, f, skin, scene)]
        meshes += [
            model.mesh.transformed(pose)
            for model, pose in zip(script.models, script.objects[f], strict=True)
        ]
        meshes.append(scene.room[0].mesh)
        depth = render(small, meshes, np.tile(T_camera_table, (len(meshes), 1, 1))).depth
        depth[depth == 0.0] = np.inf
        whole += wholly_in_view(joints_camera(script, skin, scene, f), depth, small)
    return whole / len(frames)


def joints_camera(script: Script, skin: Skin, scene: Set, f: int) -> Array:
    """Return the true joints (21, 3) of frame `f` in the camera's frame [m]."""
    joints = transform_points(script.hands[f], skin.hand.joint_positions(script.angles[f]))
    return transform_points(inverse(scene.T_table_camera), joints)


def _company(
    chosen: Cast, script: Script, skin: Skin, scene: Set, rng: np.random.Generator
) -> Gathering:
    """Return who and what else is there."""
    members: list[Company] = []
    if chosen.company == "second hand":
        members.append(second_hand(script, with_folds(skin), scene, rng))
    elif chosen.company == "bystander":
        members.append(bystander(script, scene, rng))
    if chosen.hidden == "once" and (chosen.objects == "known" or chosen.placement == "head"):
        frames = len(script.hands)
        first = int(rng.integers(round(0.45 * frames), round(0.70 * frames)))
        span = first, first + HIDDEN_FRAMES
        members.append(passing_board(scene.T_table_camera, scene.camera, script.hands, span, rng))
    return Gathering(members)
