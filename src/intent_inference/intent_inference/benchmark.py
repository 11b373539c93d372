"""Command: `python -m intent_inference.benchmark`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_inference.workshop.evaluation.inference_benchmark")
