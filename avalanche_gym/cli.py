"""The console script ``avalanche-gym``."""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

import gymnasium

from . import __version__
from .physics.jit import cache_directory


def list_environments() -> None:
    """Print the id of every environment of the package."""
    for spec in gymnasium.registry.values():
        if spec.namespace == "avalanche":
            print(spec.id)


def compile_kernels() -> None:
    """Compile what the environments need, by taking one step in each; the cache keeps it."""
    for spec in list(gymnasium.registry.values()):
        if spec.namespace == "avalanche":
            env = gymnasium.make(spec.id)
            env.reset(seed=0)
            env.step(env.action_space.sample())
            env.close()


def view(show: str | None, level: str, policies: list[Path], port: int, open_browser: bool) -> None:
    """Show demos and environments in a browser until interrupted."""
    from .policies import TrainedPolicy, read_experiment
    from .viewer import Catalogue, Viewer

    loaded = {str(read_experiment(path)["env"]): TrainedPolicy.load(path) for path in policies}
    # Who brings a policy wants to see it play.
    first = show or next(iter(loaded), "showcase")
    if show is None and policies:
        level = level or str(read_experiment(policies[0]).get("env_kwargs", {}).get("level", ""))
    viewer = Viewer(Catalogue(loaded), first, level, port)
    with viewer:
        print(f"{viewer.url} (Ctrl+C ends it)", flush=True)
        if open_browser:
            webbrowser.open(viewer.url)
        try:
            viewer.wait()
        except KeyboardInterrupt:
            print()


def main(arguments: list[str] | None = None) -> None:
    """Run the command that ``arguments`` (those of the process unless given) name."""
    parser = argparse.ArgumentParser(prog="avalanche-gym", description="Environments on a rigid-body engine")
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="list the environments")
    commands.add_parser("cache", help="print the folder of the compiled kernels")
    commands.add_parser("compile", help="compile the kernels of the environments now rather than at their first step")
    viewing = commands.add_parser("view", help="show demos, environments and policies in the browser")
    viewing.add_argument("show", nargs="?", help="showcase, terrain, carpet, planet, or the id of an environment")
    viewing.add_argument("--level", default="", help="of the environment: easy, medium or hard")
    viewing.add_argument(
        "--policy", type=Path, action="append", default=[], help="a training run or a checkpoint of it; may be repeated"
    )
    viewing.add_argument("--port", type=int, default=8765, help="of 127.0.0.1; 0 takes a free one (default: 8765)")
    viewing.add_argument("--no-browser", action="store_true", help="print the address, and open nothing")
    args = parser.parse_args(arguments)
    if args.command == "list":
        list_environments()
    elif args.command == "cache":
        print(cache_directory())
    elif args.command == "compile":
        compile_kernels()
    elif args.command == "view":
        try:
            view(args.show, args.level, args.policy, args.port, not args.no_browser)
        except (ImportError, OSError, ValueError) as error:
            parser.exit(1, f"avalanche-gym view: {error}\n")
