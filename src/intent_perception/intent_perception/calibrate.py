"""Command: `python -m intent_perception.calibrate`."""

from intent_perception.scene.calibrate_command import main

if __name__ == "__main__":
    main()
