"""The five nodes of the graph."""

NODES = {
    "recognizer": "intent_perception",
    "tracker": "intent_tracking",
    "grasp_detector": "intent_tracking",
    "inference": "intent_inference",
    "imitation": "intent_imitation",
}
"""Name of each node and its package."""
