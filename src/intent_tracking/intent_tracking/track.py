"""Command: `python -m intent_tracking.track`."""

import sys

from intent_tracking.tracker.track_command import main

if __name__ == "__main__":
    sys.exit(main())
