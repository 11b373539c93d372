"""Command: `python -m intent_perception.calibrate`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_perception.scene.calibrate_command")
