"""Command: `python -m intent_imitation.copying_picture`."""

from intent_imitation.workshop.figures.copying_figure import main

if __name__ == "__main__":
    main()
