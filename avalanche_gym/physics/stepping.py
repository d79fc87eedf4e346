"""Running the kernel of the step: shares of threads, tables that turn out too small, and worlds that fail."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from .errors import PhysicsError
from .model import CONTACTS_FULL, NON_FINITE
from .pipeline import advance
from .scene import Body
from .tables.storage import Storage


class Stepper:
    """Advances all worlds of one Storage."""

    def __init__(self, storage: Storage) -> None:
        self._storage = storage
        self._remaining = storage.arrays["remaining"]
        self._reports = storage.arrays["reports"]
        # Each thread has a workspace and a run of worlds: (address of the workspace, first world, one past the last).
        addresses = storage.workspaces.addresses
        bounds = np.linspace(0, storage.num_worlds, len(addresses) + 1).astype(int).tolist()
        shares = zip(addresses, bounds[:-1], bounds[1:], strict=True)
        self._shares = [(storage.address, *share) for share in shares]
        self._first = self._shares[0]

    def run(self, num_steps: int, bodies: Sequence[Body | None]) -> None:
        """Advance every world by ``num_steps``; see World.step. ``bodies`` give the names for errors."""
        if self._storage.moving_heights:
            self._storage.bound_heights(num_steps)
        if self._advance(num_steps):
            self._finish(bodies)

    def _advance(self, num_steps: int) -> int:
        """Run the kernel over all worlds; return how many could not finish."""
        if len(self._shares) == 1:
            # Written out: this line is most of what a call of a small scene costs beside its physics.
            address, workspace, first, last = self._first
            return advance(address, workspace, first, last, num_steps)
        # The threads end with the call: a process that forks between calls has none to lose.
        with ThreadPoolExecutor(len(self._shares)) as pool:
            parts = [pool.submit(advance, *share, num_steps) for share in self._shares]
            return sum(part.result() for part in parts)

    def _finish(self, bodies: Sequence[Body | None]) -> None:
        """Make room and go on until every world has finished or failed."""
        failures: list[tuple[int, str, int, str]] = []
        crowded: list[tuple[int, int]] = []
        limit = self._storage.most_contacts
        while True:
            for world in np.flatnonzero(self._reports["status"]).tolist():
                report = self._reports[world]
                if report["status"] == NON_FINITE:
                    body = bodies[report["detail"]]
                    name = str(report["detail"]) if body is None else repr(body.name)
                    failures.append((world, name, int(report["steps"]), "its state is not finite"))
                    self._remaining[world] = 0
                elif report["status"] == CONTACTS_FULL and report["detail"] > limit:
                    crowded.append((world, int(report["detail"])))
                    self._remaining[world] = 0
            self._storage.make_room()
            # Also ends the call in the worlds that failed: what acted in it acts no longer.
            if not self._advance(0):
                break
        overfull = [
            f"World {world}: {count} contacts exceed Options(max_contacts={limit}); raise it, or leave None to let it "
            "grow. This world stands at its last completed step."
            for world, count in crowded[:4]
        ]
        error = RuntimeError(" ".join(overfull)) if crowded else None
        if failures:
            raise PhysicsError(failures) from error
        if error is not None:
            raise error
