"""Command: `python -m intent_inference.observe`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.intention.observe_command")
