"""Recognised objects together with the shapes of those that are estimated.

They come on two topics. Whoever needs both hears of an answer once both are there, in whatever
order they arrive; the shapes are learnt by the node's own object database, through which everything
else in it finds them.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from intent_msgs.msg import ObjectShapes, RecognizedObjects

from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition import recognizer as recognized
from intent_perception.ros.convert import objects_from_msg
from intent_perception.ros.node import LATCHED, IntentNode
from intent_perception.ros.shape_messages import shape_from_msg

Deliver = Callable[[recognized.RecognizedObjects, Any], Any]
"""Takes objects and the header of their message."""


class ShapedObjects:
    """Puts answers and shapes together."""

    def __init__(self, database: ObjectDatabase, deliver: Deliver | None = None) -> None:
        """Begin with no shape.

        Args:
            database: learns the shapes.
            deliver: is told each answer whose shapes are known; None where shapes alone matter.
        """
        self._database, self._deliver = database, deliver
        self._shapes: dict[str, tuple[int, ObjectModel]] = {}
        self._stamp = -1
        self._waiting: list[Any] = []

    def on_shapes(self, message: Any) -> None:
        """Learn the shapes of a message, and deliver the answers that waited for them."""
        for shape in message.shapes:
            model = shape_from_msg(shape)
            if not self._knows(model):
                self._database.learn(model)
            self._shapes[shape.id] = shape.revision, self._database[model.name]
        self._stamp = max(self._stamp, stamp_of(message))
        waiting, self._waiting = self._waiting, []
        for answer in waiting:
            self.on_objects(answer)

    def _knows(self, model: ObjectModel) -> bool:
        """Return whether the database has this very shape.

        A recogniser that was started again gives the names of the one before to other shapes.
        """
        if model.name not in self._database:
            return False
        known = self._database[model.name]
        same = np.array_equal(known.mesh.vertices, model.mesh.vertices)
        return same and known.object_class == model.object_class

    def on_objects(self, message: Any) -> None:
        """Deliver an answer, or keep it until its shapes are there."""
        if self._deliver is None:
            return
        estimated = any(not item.model for item in message.objects)
        if estimated and stamp_of(message) > self._stamp:
            self._waiting = [*self._waiting[-3:], message]
        else:
            self._deliver(objects_from_msg(message, self._shapes), message.header)

    def forget(self) -> None:
        """Begin anew, as with another recording whose stamps may be earlier."""
        self._stamp, self._waiting = -1, []


def listen_for_objects(
    node: IntentNode, objects: str, shapes: str, database: ObjectDatabase, deliver: Deliver
) -> ShapedObjects:
    """Subscribe a node to recognised objects and the shapes of those that are estimated.

    Args:
        node: hears them.
        objects: topic of RecognizedObjects.
        shapes: topic of ObjectShapes.
        database: of the node; it learns the shapes.
        deliver: is told each answer once its shapes are known.
    """
    heard = ShapedObjects(database, deliver)
    node.listen(ObjectShapes, shapes, heard.on_shapes, LATCHED)
    node.listen(RecognizedObjects, objects, heard.on_objects, LATCHED)
    return heard


def learn_shapes(node: IntentNode, topic: str, database: ObjectDatabase) -> ShapedObjects:
    """Let a node's database learn the estimated shapes of a topic."""
    heard = ShapedObjects(database)
    node.listen(ObjectShapes, topic, heard.on_shapes, LATCHED)
    return heard
