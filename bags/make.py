"""Rebuild the bags from their seeds: `python bags/make.py --help`."""

from pathlib import Path

from intent_perception.basics.commands import command

if __name__ == "__main__":
    generated = Path(__file__).resolve().parent / "generated"
    command("intent_inference.workshop.recipes.bag_maker", generated)
