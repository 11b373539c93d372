"""Command: `python -m intent_inference.train`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.workshop.training.train_command")
