"""Command: `python -m intent_imitation.practise`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_imitation.workshop.practice.resting_practice")
