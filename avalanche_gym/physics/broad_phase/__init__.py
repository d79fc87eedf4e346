"""Which bodies could touch within the step."""
