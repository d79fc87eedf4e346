"""Speed against error: every hard case, every engine, a ladder of steps; see ``python -m benchmarks.report --help``."""
