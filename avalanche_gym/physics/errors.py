"""Errors of a running world."""

from __future__ import annotations


class PhysicsError(RuntimeError):
    """A step failed in some worlds; the others finished, and those stand where their last good step ended.

    Attributes:
        worlds: indices of the worlds concerned.
        failures: one ``(world, body, step, reason)`` each; ``step`` counts from 0 within the call.
    """

    def __init__(self, failures: list[tuple[int, str, int, str]]) -> None:
        self.failures = tuple(failures)
        self.worlds = tuple(failure[0] for failure in failures)
        shown = "; ".join(
            f"world {world}: body {body} in step {step} of this call: {reason}"
            for world, body, step, reason in failures[:4]
        )
        more = f"; and {len(failures) - 4} more worlds" if len(failures) > 4 else ""
        super().__init__(
            f"{shown}{more}. These worlds are back at their last good state; the others finished the call. "
            "Reset them, or restore a snapshot, and look for impulses, forces or velocities that are too large."
        )

    def __reduce__(self) -> tuple[type[PhysicsError], tuple[list[tuple[int, str, int, str]]]]:
        """For pickle, by which errors come out of worker processes."""
        return PhysicsError, (list(self.failures),)
