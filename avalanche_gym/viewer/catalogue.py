"""Everything that the viewer can show, by name."""

from __future__ import annotations

from collections.abc import Mapping

from ..physics.scenes.demos import DEMOS
from .demo_show import DemoShow
from .environment_show import NAMESPACE, EnvironmentShow, Policy, environment_ids
from .show import Show


class Catalogue:
    """The shows, and the policies that play in environments.

    Args:
        policies: by the id of the environment.
    """

    def __init__(self, policies: Mapping[str, Policy] | None = None) -> None:
        self.policies = dict(policies or {})
        unknown = [id for id in self.policies if id not in environment_ids()]
        if unknown:
            raise ValueError(f"A policy for {unknown[0]!r}; the environments are {', '.join(environment_ids())}.")

    def entries(self) -> list[dict[str, str]]:
        """Name, title and kind of every show."""
        demos = [{"name": demo.name, "title": demo.title, "kind": "demo"} for demo in DEMOS.values()]
        envs = [{"name": id, "title": id.partition("/")[2], "kind": "environment"} for id in environment_ids()]
        return demos + envs

    def full_name(self, name: str) -> str:
        """The name of a show, which may be given short: ``PushTerrain`` or ``PushTerrain-v0``.

        Raises:
            ValueError: there is no such show.
        """
        names = [entry["name"] for entry in self.entries()]
        for candidate in (name, f"{NAMESPACE}/{name}", f"{NAMESPACE}/{name}-v0"):
            if candidate in names:
                return candidate
        raise ValueError(f"There is no {name!r} to show; there are {', '.join(names)}.")

    def open(self, name: str, level: str = "") -> Show:
        """Make a show.

        Raises:
            ValueError: there is no such show, or it has no such level.
        """
        full = self.full_name(name)
        if full in DEMOS:
            if level:
                raise ValueError(f"The demo {full!r} has no levels; it was given {level!r}.")
            return DemoShow(full)
        return EnvironmentShow(full, level, self.policies.get(full))
