"""Command: `python -m intent_tracking.posture`."""

import sys

from intent_tracking.workshop.figures.posture_fit import main

if __name__ == "__main__":
    sys.exit(main())
