"""From which side a person takes an object for a purpose: starts for the closing fingers.

Only geometry that the task asks for is written here (keep the opening free, take the handle, leave
an end for the receiver, stay behind the rim); where the fingers end up is found by contact.
Approaches are for a right hand, in the object frame.
"""

from collections.abc import Iterator

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import rotation_from_vector
from intent_perception.objects.database import ObjectModel
from intent_tracking.workshop.person.acting.person_grasp import PersonApproach


def approaches(
    model: ObjectModel, task: str, up: Array, rng: np.random.Generator, count: int
) -> Iterator[PersonApproach]:
    """Yield ways to come to an object for a task, each a little different.

    Args:
        model: the object with its functional annotations (its box serves where it has none).
        task: one of the contract's tasks.
        up: (3,) direction away from the table in the object frame while it rests.
        rng: source of the variation.
        count: how many.

    Raises:
        ValueError: if the task cannot be done with the object.
    """
    functions = model.functions
    vessel = functions is not None and functions.opening is not None
    tool = functions is not None and len(functions.handle) > 0 and not vessel
    for _ in range(count):
        if task == "hand-over":
            yield _end_from_above(model, up, rng)
        elif task == "pouring" and vessel:
            yield _side(model, rng)
        elif task == "dish-washing" and vessel:
            yield _bottom(model, rng)
        elif task == "tool-use" and tool:
            yield from _overhand(model, up, rng)
        else:
            raise ValueError(f"no way to take a {model.object_class} for {task!r}")


def leaves_function_free(model: ObjectModel, task: str, points: Array) -> bool:
    """Return whether a hand keeps out of what the task needs: cavity, stream of liquid, rim.

    Args:
        model: the object.
        task: what the object is taken for.
        points: (S, 3) skin of the closed hand in the object frame [m].
    """
    functions = model.functions
    if functions is None or functions.opening is None:
        return True
    opening = functions.opening
    offset = points - opening.center
    height = offset @ opening.normal
    lateral = np.linalg.norm(offset - height[:, None] * opening.normal, axis=1)
    if np.any((height < 0.002) & (height > -0.012) & (lateral < 0.9 * opening.radius)):
        return False
    if task == "pouring":
        return not np.any((height > 0.0) & (height < 0.06) & (lateral < 0.9 * opening.radius))
    return task != "dish-washing" or bool(height.max() < -0.010)


def _jittered(x: Array, z: Array, rng: np.random.Generator, roll: float, tilt: float) -> Array:
    """Return R_object_hand near the given finger direction x and palm normal z."""
    z = z / np.linalg.norm(z)
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z], axis=1)
    turn = rotation_from_vector(np.array([0.0, 0.0, rng.uniform(-roll, roll)]))
    lean = rotation_from_vector(np.append(rng.uniform(-tilt, tilt, 2), 0.0))
    return rotation @ turn @ lean


def _vessel(model: ObjectModel) -> tuple[Array, Array, float, float | None]:
    """Return the axis, the bottom centre, the height and the azimuth of a handle (or None)."""
    assert model.functions is not None
    opening = model.functions.opening
    assert opening is not None
    axis = opening.normal / np.linalg.norm(opening.normal)
    along = model.mesh.vertices @ axis
    height = float(opening.center @ axis - along.min())
    handle = [p.mesh.vertices for p in model.parts if p.name == "handle"]
    azimuth = None
    if handle:
        u, v = _across(axis)
        offset = np.concatenate(handle).mean(axis=0) - opening.center
        azimuth = float(np.arctan2(offset @ v, offset @ u))
    return axis, opening.center - height * axis, height, azimuth


def _across(axis: Array) -> tuple[Array, Array]:
    helper = np.array([1.0, 0, 0]) if abs(axis[0]) < 0.9 else np.array([0, 1.0, 0])
    u = helper - axis * (helper @ axis)
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def _side(model: ObjectModel, rng: np.random.Generator) -> PersonApproach:
    """Around the body, thumb to the opening, which stays free."""
    axis, bottom, height, handle = _vessel(model)
    u, v = _across(axis)
    azimuth = rng.uniform(-np.pi, np.pi)
    if handle is not None:  # the handle stays in the gap between finger tips and thumb
        azimuth = handle - np.radians(rng.uniform(160.0, 220.0))
    outwards = np.cos(azimuth) * u + np.sin(azimuth) * v
    rotation = _jittered(np.cross(axis, outwards), -outwards, rng, 0.30, 0.12)
    low = 0.056  # half a hand above the table
    high = max(low + 0.004, min(height - 0.050, 0.62 * height))
    return PersonApproach(rotation, bottom + rng.uniform(low, high) * axis, "power")


def _bottom(model: ObjectModel, rng: np.random.Generator) -> PersonApproach:
    """Over the bottom of a vessel that stands on its rim; nothing near the rim or inside."""
    axis, bottom, height, _ = _vessel(model)
    u, v = _across(axis)
    azimuth = rng.uniform(-np.pi, np.pi)
    x = np.cos(azimuth) * u + np.sin(azimuth) * v
    rotation = _jittered(x, axis, rng, 0.3, 0.2)
    depth = rng.uniform(0.016, max(0.020, min(0.035, height - 0.055)))
    return PersonApproach(
        rotation, bottom + depth * axis, "precision", _width(model, bottom, axis, depth)
    )


def _width(model: ObjectModel, origin: Array, axis: Array, depth: float) -> float:
    """Return the diameter at `depth` along the axis, without a handle [m]."""
    parts = [p.mesh.vertices for p in model.parts if p.name != "handle"]
    vertices = np.concatenate(parts) if parts else model.mesh.vertices
    offset = vertices - origin
    along = offset @ axis
    radius = np.linalg.norm(offset - along[:, None] * axis, axis=1)
    near = np.abs(along - depth) < 0.02
    return 2.0 * float(radius[near].max() if near.any() else radius.max())


def _end_from_above(model: ObjectModel, up: Array, rng: np.random.Generator) -> PersonApproach:
    """Finger tips on one end, from above: the rest of the object is left to the receiver."""
    u, v = _across(up)
    azimuth = rng.uniform(-np.pi, np.pi)
    x = np.cos(azimuth) * u + np.sin(azimuth) * v
    rotation = _jittered(x, -up, rng, 0.3, 0.25)
    vertices = model.mesh.vertices
    along = vertices @ up
    functions = model.functions
    if functions is not None and functions.handle and functions.opening is None:
        target, depth, width = _free_end(model, x, rng)
        return PersonApproach(rotation, target - depth * up, "precision", width)
    top = vertices[along > along.max() - 0.03]
    centre = 0.5 * (top.min(axis=0) + top.max(axis=0))
    if functions is not None and functions.opening is not None:
        centre = functions.opening.center.copy()
    depth = rng.uniform(0.012, 0.028)
    target = centre + up * (along.max() - depth - centre @ up)
    if functions is not None and functions.opening is not None:
        return PersonApproach(rotation, target, "precision", _width(model, target, up, 0.0))
    return PersonApproach(rotation, target, "precision", float(np.ptp(top @ x)))


def _free_end(
    model: ObjectModel, across: Array, rng: np.random.Generator
) -> tuple[Array, float, float]:
    """Return a point of the end that the receiver does not want, finger depth and width [m]."""
    functions = model.functions
    assert functions is not None
    held = functions.handle if functions.edge is not None else functions.functional
    points = np.concatenate([p.mesh.vertices for p in model.parts if p.name in held])
    axis = tool_axis(model)
    along = points @ axis
    if functions.edge is not None:  # a knife is given with the fingers away from the edge
        point = points[along < along.min() + 0.035].mean(axis=0)
    else:
        low, high = np.quantile(along, [0.3, 0.7])
        point = points.mean(axis=0)
        point = point + axis * (rng.uniform(low, high) - point @ axis)
    near = np.linalg.norm(points - point, axis=1) < 0.02
    near = near if near.any() else np.ones(len(points), dtype=bool)
    return point, rng.uniform(-0.004, 0.006), float(np.ptp(points[near] @ across))


def tool_axis(model: ObjectModel) -> Array:
    """Return the unit direction (3,) from the handle to the functional end, object frame."""
    functions = model.functions
    assert functions is not None
    handle = np.concatenate([p.mesh.vertices for p in model.parts if p.name in functions.handle])
    rest = np.concatenate([p.mesh.vertices for p in model.parts if p.name in functions.functional])
    axis = rest.mean(axis=0) - handle.mean(axis=0)
    principal = np.zeros(3)
    principal[np.argmax(np.abs(axis))] = np.sign(axis[np.argmax(np.abs(axis))])
    return principal


def _overhand(model: ObjectModel, up: Array, rng: np.random.Generator) -> Iterator[PersonApproach]:
    """Hand over the handle, thumb side to the working end, knuckles in the working direction.

    Yields nothing while the object lies with its edge or face to the wrong side.
    """
    functions = model.functions
    assert functions is not None
    axis = tool_axis(model)
    handle = np.concatenate([p.mesh.vertices for p in model.parts if p.name in functions.handle])
    along = handle @ axis
    x = np.cross(-axis, -up)  # y points away from the working end: the thumb side lies towards it
    if functions.edge is not None and functions.edge.direction @ x < 0.5:
        return
    if functions.face is not None and abs(functions.face.normal @ x) < 0.6:
        return
    rotation = _jittered(x, -up, rng, 0.22, 0.30)
    middle = 0.5 * (handle.min(axis=0) + handle.max(axis=0))
    share = rng.uniform(0.40, 0.60)
    target = middle + axis * (along.min() + share * np.ptp(along) - middle @ axis)
    yield PersonApproach(rotation, target, "power")
