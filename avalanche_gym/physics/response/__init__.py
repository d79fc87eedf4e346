"""What contacts do to the motion of one world: solve the impulses, move the bodies, remember."""

from .pile_stage import step_pile
from .stage import commit, solve_contacts, solve_problem

__all__ = ["commit", "solve_contacts", "solve_problem", "step_pile"]
