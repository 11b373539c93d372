"""Command: `python -m intent_tracking.benchmark`."""

import sys

from intent_tracking.workshop.figures.tracking_benchmark import main

if __name__ == "__main__":
    sys.exit(main())
