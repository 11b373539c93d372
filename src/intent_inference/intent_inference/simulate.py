"""Command: `python -m intent_inference.simulate`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.workshop.simulation.simulate_command")
