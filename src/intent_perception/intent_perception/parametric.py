"""Command: `python -m intent_perception.parametric`."""

from intent_perception.workshop.things.object_catalogue import main

if __name__ == "__main__":
    main()
