"""The environments: one folder each, all on one batched task."""
