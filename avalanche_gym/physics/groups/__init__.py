"""Islands whose impacts are located in time, stepped from one to the next."""

from .stage import step_groups

__all__ = ["step_groups"]
