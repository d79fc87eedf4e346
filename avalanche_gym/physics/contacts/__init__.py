"""From touching shapes to the contact problem: materials, what lasts from step to step, islands."""
