"""What every module may lean on: parameters with ranges, array types, compilation."""
