"""Command: `python -m intent_imitation.build_library`."""

from intent_imitation.workshop.practice.library_maker import main

if __name__ == "__main__":
    main()
