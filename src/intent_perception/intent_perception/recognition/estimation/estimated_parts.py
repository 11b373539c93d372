"""What the makers of estimated shapes share."""

from dataclasses import dataclass

from intent_perception.basics.arrays import Array
from intent_perception.objects.families.designed_object import Color, DesignedObject
from intent_perception.recognition.estimation.things import SeenThing


@dataclass(frozen=True, eq=False)
class Draft:
    """A shape and where it is."""

    made: DesignedObject
    """In the frame that it was drawn in."""
    T_table_draft: Array
    """(4, 4) of that frame."""


def color_of(thing: SeenThing) -> Color:
    """Return the colour of a thing, RGB in 0..1."""
    red, green, blue = (float(value) for value in thing.color)
    return red, green, blue
