"""Command: `python -m intent_perception.parametric`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_perception.workshop.things.object_catalogue")
