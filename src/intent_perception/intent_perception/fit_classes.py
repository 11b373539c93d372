"""Command: `python -m intent_perception.fit_classes`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_perception.workshop.figures.class_fit")
