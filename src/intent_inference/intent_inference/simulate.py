"""Command: `python -m intent_inference.simulate`."""

import sys

from intent_inference.workshop.simulation.simulate_command import main

if __name__ == "__main__":
    sys.exit(main())
