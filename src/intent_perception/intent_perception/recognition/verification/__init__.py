"""Is a pose right? Hypotheses held against the depth image, refined and measured."""
