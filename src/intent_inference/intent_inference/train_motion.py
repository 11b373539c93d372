"""Command: `python -m intent_inference.train_motion`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.workshop.acting.train_motion_command")
