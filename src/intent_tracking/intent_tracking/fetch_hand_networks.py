"""Command: `python -m intent_tracking.fetch_hand_networks`."""

import sys

from intent_tracking.hands.fetch_networks_command import main

if __name__ == "__main__":
    sys.exit(main())
