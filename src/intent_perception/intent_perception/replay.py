"""Command: `python -m intent_perception.replay`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_perception.bags.playback")
