"""The console script ``avalanche-gym``."""

from __future__ import annotations

import argparse

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


def main(arguments: list[str] | None = None) -> None:
    """Run the command that ``arguments`` (those of the process unless given) name."""
    parser = argparse.ArgumentParser(prog="avalanche-gym", description="Environments on a rigid-body engine")
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="list the environments")
    commands.add_parser("cache", help="print the folder of the compiled kernels")
    commands.add_parser("compile", help="compile the kernels of the environments now rather than at their first step")
    args = parser.parse_args(arguments)
    if args.command == "list":
        list_environments()
    elif args.command == "cache":
        print(cache_directory())
    elif args.command == "compile":
        compile_kernels()
