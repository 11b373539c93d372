"""Command: `python -m intent_imitation.practise`."""

from intent_imitation.workshop.practice.resting_practice import main

if __name__ == "__main__":
    main()
