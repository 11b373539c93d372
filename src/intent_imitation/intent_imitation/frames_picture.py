"""Command: `python -m intent_imitation.frames_picture`."""

from intent_imitation.workshop.figures.hand_frames_figure import main

if __name__ == "__main__":
    main()
