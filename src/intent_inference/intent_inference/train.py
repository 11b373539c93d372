"""Command: `python -m intent_inference.train`."""

import sys

from intent_inference.workshop.training.train_command import main

if __name__ == "__main__":
    sys.exit(main())
