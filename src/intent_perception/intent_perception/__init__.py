"""RGB-D frame to recognised objects on the table (Sec. III, III-A)."""
