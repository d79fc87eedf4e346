"""What contacts do to the motion of one world: solve the impulses, move the bodies, remember."""

from .blow import strike
from .pile_stage import step_pile
from .stage import commit, solve_problem, sort_contacts, step_islands

__all__ = ["commit", "solve_problem", "sort_contacts", "step_islands", "step_pile", "strike"]
