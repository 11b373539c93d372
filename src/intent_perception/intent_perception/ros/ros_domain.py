"""A ROS domain of one's own, so that two runs on one machine do not hear each other."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def private_domain() -> Iterator[int]:
    """Keep to a ROS domain that no other run on this machine uses (as scripts/graph.sh does).

    Yields:
        Its number; ROS_DOMAIN_ID holds it for this process and those that it starts.

    Raises:
        RuntimeError: if all hundred domains are in use.
    """
    for offset in range(100):
        domain = 1 + (os.getpid() + offset) % 100
        path = Path(tempfile.gettempdir()) / f"intent_domain_{os.getuid()}_{domain}"
        with path.open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            os.environ["ROS_DOMAIN_ID"] = str(domain)
            os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
            yield domain
            return
    raise RuntimeError("a hundred runs are active on this machine")
