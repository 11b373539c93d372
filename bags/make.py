"""Rebuild the bags from their seeds: `python bags/make.py --help`."""

from pathlib import Path

from intent_inference.workshop.recipes.bag_maker import main

if __name__ == "__main__":
    main(Path(__file__).resolve().parent / "generated")
