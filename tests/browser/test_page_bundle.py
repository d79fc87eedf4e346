"""The bundle that the package carries is what its source builds."""

import shutil
import subprocess
from pathlib import Path

import pytest

import avalanche_gym.viewer
from avalanche_gym.viewer.server import FILES

pytestmark = pytest.mark.verify

FOLDER = Path(avalanche_gym.viewer.__file__).parent


def test_the_bundle_is_up_to_date(tmp_path):
    npm = shutil.which("npm")
    if npm is None:
        pytest.fail("This test needs npm: apt-get install npm.")
    page = tmp_path / "page"
    shutil.copytree(FOLDER / "page", page, ignore=shutil.ignore_patterns("node_modules"))
    for command in (["ci", "--no-audit", "--no-fund"], ["run", "build"]):
        result = subprocess.run([npm, *command], cwd=page, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
    for name in ("three-license.txt", *(name for name, _ in FILES.values())):
        built, carried = (folder / name for folder in (tmp_path / "static", FOLDER / "static"))
        assert built.read_bytes() == carried.read_bytes(), f"{name} is stale: make page"
