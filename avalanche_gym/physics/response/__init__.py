"""What contacts do to the motion of one world: solve the impulses, move the bodies, remember."""

from .blow import strike
from .island import step_islands
from .pile_stage import step_pile
from .solving import solve_problem
from .stage import commit, sort_contacts

__all__ = ["commit", "solve_problem", "sort_contacts", "step_islands", "step_pile", "strike"]
