"""Command: `python -m intent_imitation.own_hand`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_imitation.workshop.practice.own_hand_command")
