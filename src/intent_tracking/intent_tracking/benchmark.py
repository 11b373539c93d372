"""Command: `python -m intent_tracking.benchmark`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_tracking.workshop.figures.tracking_benchmark")
