"""Command: `python -m intent_imitation.build_table`."""

from intent_perception.basics.commands import command

if __name__ == "__main__":
    command("intent_imitation.workshop.practice.table_merge")
