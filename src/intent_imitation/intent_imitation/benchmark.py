"""Command: `python -m intent_imitation.benchmark`."""

from intent_imitation.workshop.trials.imitation_benchmark import main

if __name__ == "__main__":
    main()
