"""Results of which the last one holds: a late joiner hears it, and nothing that holds no longer."""

from collections.abc import Callable
from typing import Any

from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATEST = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Publishers of results of which only the last holds: a late joiner is told nothing else."""
_FLEETING = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    lifespan=Duration(seconds=1.0),
)
"""For what holds only for the moment, on a topic whose listeners ask for latched messages."""
_ON_ITS_WAY = Duration(seconds=0.2)


class LatestResult:
    """Publishes results on a latched topic, and takes the last one back when it is void."""

    def __init__(self, node: Node, kind: Any, topic: str) -> None:
        """Advertise.

        Args:
            node: that publishes.
            kind: message type.
            topic: relative name.
        """
        self._node, self._kind, self._topic = node, kind, topic
        self._publisher = self._advertised()
        self._fleeting: Any = None
        self._holds = False

    def publish(self, message: Any) -> None:
        """Publish what holds until the next result."""
        self._publisher.publish(message)
        self._holds = True

    def publish_fleeting(self, message: Any) -> None:
        """Publish what nobody shall be told later; what was said before holds no longer."""
        self.take_back()
        if self._fleeting is None:
            self._fleeting = self._node.create_publisher(self._kind, self._topic, _FLEETING)
        self._fleeting.publish(message)

    def take_back(self) -> None:
        """Let no late joiner hear what was published: the publisher goes with all that it keeps."""
        if self._holds:
            self._publisher.wait_for_all_acked(_ON_ITS_WAY)  # who listens shall still get it
            self._node.destroy_publisher(self._publisher)
            self._publisher = self._advertised()
        self._holds = False

    def _advertised(self) -> Any:
        return self._node.create_publisher(self._kind, self._topic, LATEST)


class ResultOnDemand(LatestResult):
    """A latest result that takes long to make: it is made once somebody listens."""

    def __init__(self, node: Node, kind: Any, topic: str, make: Callable[[], Any]) -> None:
        """Advertise.

        Args:
            node: that publishes.
            kind: message type.
            topic: relative name.
            make: returns the message that holds now.
        """
        self._make, self._stale = make, False
        super().__init__(node, kind, topic)

    def renew(self) -> None:
        """Say that another message holds from now on."""
        self._stale = True
        self._serve()

    def _serve(self, _: Any = None) -> None:
        if self._stale and self._publisher.get_subscription_count():
            self._stale = False
            self.publish(self._make())

    def _advertised(self) -> Any:
        events = PublisherEventCallbacks(matched=self._serve)
        return self._node.create_publisher(self._kind, self._topic, LATEST, event_callbacks=events)
