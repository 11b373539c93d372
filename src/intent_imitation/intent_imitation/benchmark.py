"""Command: `python -m intent_imitation.benchmark`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_imitation.workshop.trials.imitation_benchmark")
