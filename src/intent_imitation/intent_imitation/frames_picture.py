"""Command: `python -m intent_imitation.frames_picture`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_imitation.workshop.figures.hand_frames_figure")
