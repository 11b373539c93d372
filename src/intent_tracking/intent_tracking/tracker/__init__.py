"""The tracker of Sec. III-B over a sequence: starts, follows, doubts, recovers."""
