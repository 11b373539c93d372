"""Pictures of the documents that need the whole system."""
