"""Command: `python -m intent_inference.evaluate`."""

import sys

from intent_inference.workshop.evaluation.evaluate_command import main

if __name__ == "__main__":
    sys.exit(main())
