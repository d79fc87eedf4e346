"""Training and judging policies with Stable-Baselines3: scripts, run as ``python -m training.<script>``."""
