"""Command: `python -m intent_inference.make_demonstrations`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.workshop.evaluation.demonstration_maker")
