"""Command: `python -m intent_imitation.build_table`."""

from intent_imitation.workshop.practice.table_merge import main

if __name__ == "__main__":
    main()
