"""Command: `python -m intent_inference.benchmark`."""

import sys

from intent_inference.workshop.evaluation.inference_benchmark import main

if __name__ == "__main__":
    sys.exit(main())
