"""Command: `python -m intent_tracking.fetch_hand_networks`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_tracking.hands.fetch_networks_command")
