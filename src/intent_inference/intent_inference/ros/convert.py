"""Task posteriors to and from messages."""

from typing import Any

import numpy as np
from intent_msgs import msg as msgs

from intent_inference.intention.contributions import Contribution
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.ros.convert import header_at


def posterior_to_msg(posterior: TaskPosterior) -> Any:
    """Return the message of a posterior."""
    return msgs.TaskPosterior(
        header=header_at(posterior.stamp),
        object_id=posterior.object_id,
        object_class=posterior.object_class,
        tasks=list(posterior.tasks),
        probability=[float(p) for p in posterior.probability],
        intends=[float(p) for p in posterior.intends],
        stage=posterior.stage,
        best=posterior.best or "",
        above_threshold=list(posterior.above_threshold),
        preliminary=bool(posterior.preliminary),
        unknown_score=float(posterior.unknown_score),
        missing=list(posterior.missing),
        explanation=[
            msgs.Contribution(task=c.task, variable=c.variable, log_odds=float(c.log_odds))
            for c in posterior.explanation
        ],
    )


def posterior_from_msg(message: Any) -> TaskPosterior:
    """Return the posterior of a message."""
    return TaskPosterior(
        stamp=stamp_of(message),
        object_id=message.object_id,
        object_class=message.object_class,
        tasks=tuple(message.tasks),
        probability=np.array(message.probability, dtype=np.float64),
        intends=np.array(message.intends, dtype=np.float64),
        stage=message.stage,
        best=message.best or None,
        above_threshold=tuple(message.above_threshold),
        preliminary=message.preliminary,
        unknown_score=message.unknown_score,
        missing=tuple(message.missing),
        explanation=tuple(
            Contribution(c.task, c.variable, c.log_odds) for c in message.explanation
        ),
    )
