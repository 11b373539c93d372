"""Command: `python -m intent_perception.fit_confidence`."""

from intent_perception.workshop.figures.confidence_fit import main

if __name__ == "__main__":
    main()
