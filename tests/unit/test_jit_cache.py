"""The cache of compiled code: never stale, found where it can be written, and safe to fork beside."""

import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.jit import cache, stamps

PACKAGE = stamps.PACKAGE_ROOT
NO_CACHE = shutil.ignore_patterns("__pycache__")
FORK_SECONDS = 60.0  # a child that hangs is killed after this

# A kernel that reaches maths/vec3.py through one more file, and a stage of its own that does the same.
KERNELS = {
    "inner.py": """
        from ..jit import kernel
        from ..maths import vec3

        @kernel
        def measure(x):
            return vec3.norm_squared((x, 0.0, 0.0))
        """,
    "outer.py": """
        import numpy as np
        from ..jit import call_stage, entry_point, stage
        from . import inner

        @stage
        def squared(x):
            return np.int64(inner.measure(float(x)))

        @entry_point
        def run(address, x):
            return inner.measure(x), call_stage(address, np.int64(x))
        """,
}
SCRIPT = """
import sys
from avalanche_gym.physics.probe.outer import run, squared
print(*run(squared.address, 3.0), "avalanche_gym" if run.stats.cache_hits else "compiled")
"""


@pytest.fixture
def package(tmp_path):
    """A copy of the foundation alone, with two probe files."""
    copy = tmp_path / "source" / "avalanche_gym"
    physics_folder = copy / "physics"
    (physics_folder / "probe").mkdir(parents=True)
    for name in ("__init__.py", "physics/__init__.py", "physics/probe/__init__.py"):
        (copy / name).touch()
    shutil.copytree(PACKAGE / "physics" / "jit", physics_folder / "jit", ignore=NO_CACHE)
    shutil.copytree(PACKAGE / "physics" / "maths", physics_folder / "maths", ignore=NO_CACHE)
    for name, text in KERNELS.items():
        lines = [line[8:] for line in text.splitlines()]
        (physics_folder / "probe" / name).write_text("\n".join(lines) + "\n")
    return copy


def run_script(package, script, **variables):
    """Words that a script prints in a process of its own, and its messages."""
    keep = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=package.parent,
        env={**keep, "PYTHONDONTWRITEBYTECODE": "1", **variables},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return done.stdout.split(), done.stderr


def run_probe(package, **variables):
    """Results of the probe, and whether they came from the cache."""
    (value, staged, how), messages = run_script(package, SCRIPT, **variables)
    return float(value), int(staged), how == "avalanche_gym", messages


def test_an_edit_to_any_kernel_file_is_seen(package, tmp_path):
    """Helpers two files away, also inside a stage that is reached by its address."""
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    value, staged, cached, messages = run_probe(package, **cache)
    assert (value, staged, cached) == (9.0, 9, False)
    assert messages.count("compiling the engine") == 1 and str(tmp_path / "kernels") in messages
    value, staged, cached, messages = run_probe(package, **cache)
    assert (value, staged, cached) == (9.0, 9, True) and messages == ""
    helper = package / "physics" / "maths" / "vec3.py"
    helper.write_text(helper.read_text().replace("a[0] * a[0] +", "2.0 * a[0] * a[0] +", 1))
    value, staged, cached, _ = run_probe(package, **cache)
    assert (value, staged, cached) == (18.0, 18, False)
    # An edit that concerns nobody here keeps the cache.
    (package / "physics" / "maths" / "unused.py").write_text("ONE = 1\n")
    assert run_probe(package, **cache)[:3] == (18.0, 18, True)


def test_a_kernel_is_compiled_with_what_calls_it_and_can_be_called_from_python_too(package, tmp_path):
    """Its code goes into the stage; machine code of its own is made when Python asks for it, and both are kept."""
    ask = "from avalanche_gym.physics.probe.inner import measure; print(len(measure.overloads), measure(2.0))"
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    for _ in range(2):
        words, _ = run_script(package, SCRIPT + ask, **cache)
        assert words[-2:] == ["0", "4.0"]
    assert list((tmp_path / "kernels").glob("inner.measure*.linked.nbi"))


def test_a_package_that_cannot_be_written_uses_the_users_cache(package, tmp_path):
    # A file in the way of the folder stops even a process that may write anywhere.
    (package / "__pycache__").touch()
    *_, cached, messages = run_probe(package, XDG_CACHE_HOME=str(tmp_path / "user"))
    assert not cached and str(tmp_path / "user" / "avalanche_gym") in messages
    assert run_probe(package, XDG_CACHE_HOME=str(tmp_path / "user"))[2]
    (tmp_path / "user2").touch()
    *_, messages = run_probe(package, XDG_CACHE_HOME=str(tmp_path / "user2"), TMPDIR=str(tmp_path))
    assert f"{tmp_path}/avalanche_gym-" in messages


def test_a_process_without_a_home_compiles_all_the_same(tmp_path, monkeypatch):
    """As in a container whose user is a bare number: no HOME, and no entry in the table of users."""
    monkeypatch.setattr(cache, "PACKAGE_ROOT", tmp_path / "file")
    (tmp_path / "file").touch()
    monkeypatch.setattr("pwd.getpwuid", {}.__getitem__)
    for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    cache.cache_directory.cache_clear()
    try:
        assert cache.cache_directory().parent == tmp_path
    finally:
        cache.cache_directory.cache_clear()


def test_a_relative_folder_stays_where_it_is_when_the_process_moves(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "kernels")
    monkeypatch.chdir(tmp_path)
    cache.cache_directory.cache_clear()
    try:
        assert cache.cache_directory() == tmp_path / "kernels"
    finally:
        cache.cache_directory.cache_clear()


# Files with what Python calls, and with what compiled code calls by address. Each has a stamp of its own.
ROOTS = (
    "pipeline.py",
    "detection.py",
    "following.py",
    "response/stage.py",
    "response/island.py",
    "response/solving.py",
    "response/blow.py",
    "response/pile_stage.py",
    "contacts/sleeping.py",
    "seams/stage.py",
    "hindsight.py",
    "groups/stage.py",
    "events/impact_time.py",
    "narrow_phase/convex_pairs.py",
    "narrow_phase/terrain_pairs.py",
    "frames.py",
    "diagnostics.py",
    "probes/ask.py",
    "probes/overlap.py",
)


def kernel_files():
    """Files of the loaded engine that hold compiled functions, and the layout of the tables; relative to physics."""
    marks = ("\n@kernel\n", "\n@entry_point\n", "\n@stage\n")
    modules = [module for name, module in sys.modules.items() if name.startswith("avalanche_gym.physics.")]
    files = [Path(module.__file__) for module in modules]
    compiled = [file for file in files if any(mark in file.read_text() for mark in marks)]
    layouts = ("model.py", "shape_rows.py", "layout.py")
    return [*sorted(file.relative_to(PACKAGE / "physics").as_posix() for file in compiled), *layouts]


def test_every_kernel_file_counts_in_the_stamps_of_what_uses_it(tmp_path, monkeypatch):
    copy = tmp_path / "avalanche_gym"
    shutil.copytree(PACKAGE, copy, ignore=NO_CACHE)
    monkeypatch.setattr(stamps, "PACKAGE_ROOT", copy)

    def every_stamp():
        stamps.source_stamp.cache_clear()
        stamps._scan.cache_clear()
        return {root: stamps.source_stamp(copy / "physics" / root) for root in ROOTS}

    changed = {}
    try:
        before = every_stamp()
        for name in kernel_files():
            place = copy / "physics" / name
            original = place.read_bytes()
            place.write_bytes(original + b"\n# edited\n")
            after = every_stamp()
            place.write_bytes(original)
            changed[name] = {root for root in ROOTS if after[root] != before[root]}
        assert every_stamp() == before
    finally:
        stamps.source_stamp.cache_clear()
        stamps._scan.cache_clear()
    assert len(changed) > 40 and all(changed.values())
    assert all(root in changed[root] for root in ROOTS)
    for name in ("model.py", "shape_rows.py", "layout.py", "memory.py", "maths/vec3.py"):
        assert changed[name] == set(ROOTS)
    assert "response/solving.py" in changed["solver/newton.py"]
    assert "narrow_phase/convex_pairs.py" in changed["narrow_phase/box.py"]
    # Code behind an address is not part of its caller.
    assert "pipeline.py" not in changed["solver/newton.py"]


# --- Fork -----------------------------------------------------------------------------------------


def small_world(threads):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.3))
    return physics.World(scene, num_worlds=2, options=physics.Options(time_step=0.01, threads=threads))


def step_and_send(world, connection):
    world.step(20)
    fresh = small_world(2)
    fresh.step(30)
    connection.send((world.position.copy(), fresh.position.copy()))


@pytest.mark.parametrize("threads", [1, 2])
def test_forking_after_stepping_does_not_hang(threads):
    """The child goes on with its copy of the world, and steps one of its own with two threads."""
    context = multiprocessing.get_context("fork")
    world = small_world(threads)
    world.step(10)
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=step_and_send, args=(world, sender), daemon=True)
    child.start()
    try:
        assert receiver.poll(FORK_SECONDS), "the child hangs"
        position, fresh = receiver.recv()
        child.join(FORK_SECONDS)
        assert child.exitcode == 0
    finally:
        child.kill()
    world.step(20)
    assert np.array_equal(position, world.position) and np.array_equal(fresh, world.position)
