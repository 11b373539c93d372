"""Command: `python -m intent_tracking.track`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_tracking.tracker.track_command")
