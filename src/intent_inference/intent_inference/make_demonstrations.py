"""Command: `python -m intent_inference.make_demonstrations`."""

import sys

from intent_inference.workshop.evaluation.demonstration_maker import main

if __name__ == "__main__":
    sys.exit(main())
