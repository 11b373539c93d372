"""The recogniser of Sec. III-A: from hypotheses to the objects on the table."""
