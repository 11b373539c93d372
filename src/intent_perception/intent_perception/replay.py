"""Command: `python -m intent_perception.replay`."""

from intent_perception.bags.playback import main

if __name__ == "__main__":
    main()
