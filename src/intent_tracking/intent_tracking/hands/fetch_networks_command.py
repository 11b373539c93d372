"""Command: get the networks that find hands in colour images.

python -m intent_tracking.fetch_hand_networks

Takes four small files out of the wheel mediapipe==0.10.21 (36 MB, from the package index that pip
uses) and checks them. They go into INTENT_HAND_NETWORKS where it is set, else into this Python's
share/intent/hand_networks, else into ~/.local/share/intent/hand_networks.
"""

import argparse
import sys

from intent_tracking.hands.networks.network_files import (
    fetch_networks,
    missing_networks,
    network_file,
)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_tracking.fetch_hand_networks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(arguments)
    if not missing_networks():
        print(f"the hand networks are in {network_file('palm_detection_full').parent}")
        return 0
    try:
        folder = fetch_networks()
    except ValueError as error:
        print(f"fetch_hand_networks: {error}", file=sys.stderr)
        return 2
    print(f"the hand networks are now in {folder}")
    return 0
