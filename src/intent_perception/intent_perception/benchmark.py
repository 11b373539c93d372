"""Command: `python -m intent_perception.benchmark`."""

from intent_perception.workshop.figures.recognition_benchmark import main

if __name__ == "__main__":
    main()
