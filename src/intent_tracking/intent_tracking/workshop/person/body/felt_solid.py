"""An object as fingers feel it from outside: cups are filled, so that no finger slips through."""

import numpy as np
from scipy.ndimage import binary_fill_holes, distance_transform_edt

from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectModel


def graspable(model: ObjectModel, spacing: float = 0.002) -> SignedDistance:
    """Return the signed distance of an object with its cavity filled up to the rim.

    A wall is thinner than the grid can resolve: a finger pushed against it would come out inside.
    """
    sdf = SignedDistance.from_mesh(model.mesh, spacing, 0.03)
    functions = model.functions
    if functions is None or functions.opening is None:
        return sdf
    opening = functions.opening
    index = np.stack(np.meshgrid(*[np.arange(n) for n in sdf.values.shape], indexing="ij"), -1)
    offset = sdf.origin + sdf.spacing * index - opening.center
    height = offset @ opening.normal
    lateral = np.linalg.norm(offset - height[..., None] * opening.normal, axis=-1)
    plug = (np.abs(height) < sdf.spacing) & (lateral < opening.radius + sdf.spacing)
    solid = binary_fill_holes((sdf.values < 0.3 * sdf.spacing) | plug)
    solid &= (height < 0.0) | (sdf.values < 0.0)
    depth, nearest = distance_transform_edt(solid, return_indices=True)
    outside = sdf.values[tuple(nearest)]
    inner = outside - (sdf.spacing * depth).astype(np.float32)
    values = np.where(solid, np.minimum(sdf.values, inner), sdf.values)
    return SignedDistance(sdf.origin, sdf.spacing, values.astype(np.float32))
