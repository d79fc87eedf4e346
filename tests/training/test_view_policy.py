"""`avalanche-gym view`: a policy from a training run plays, and what cannot be shown is refused."""

import os
import signal
import subprocess
import sys
import urllib.request

import gymnasium
import pytest
from stable_baselines3 import PPO

import avalanche_gym  # noqa: F401  (registers the ids)
from avalanche_gym import cli
from avalanche_gym.policies import TrainedPolicy
from avalanche_gym.viewer import Catalogue
from training.experiment import Experiment, save_model

ID = "avalanche/PlanetLanding-v0"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """What a training run leaves; the policy is untrained."""
    folder = tmp_path_factory.mktemp("run")
    Experiment("ppo", ID, {"level": "medium"}).save(folder)
    save_model(PPO("MlpPolicy", gymnasium.make(ID), policy_kwargs={"net_arch": [8]}, device="cpu"), folder)
    return folder


def test_a_policy_acts_in_its_environment(run_folder):
    show = Catalogue({ID: TrainedPolicy.load(run_folder)}).open(ID)
    assert show.driver == "policy" and show.drivers == ("policy", "random", "zero")
    for _ in range(5):
        assert show.advance(1.0) == pytest.approx(0.1)
    assert show.counters()["episode step"] == 5
    show.drive_with("zero")
    show.single_step()
    with pytest.raises(ValueError, match="driver 'dog'"):
        show.drive_with("dog")


def test_an_episode_that_ended_is_shown_for_a_while_and_then_begins_anew():
    show = Catalogue().open(ID)
    show.drive_with("zero")
    while show.counters()["outcome"] == "running":
        show.advance(1.0)
    steps = show.counters()["episode step"]
    show.advance(1.0)
    assert show.counters()["episode step"] == steps
    for _ in range(12):
        show.advance(1.0)
    assert show.counters()["outcome"] == "running"


def test_the_command_serves_the_page_until_interrupted(run_folder):
    program = "from avalanche_gym.cli import main; main()"
    arguments = ["view", "--policy", str(run_folder), "--port", "0", "--no-browser"]
    command = [sys.executable, "-c", program, *arguments]
    # A shell that runs the tests in the background lets its children ignore the signal.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    try:
        url = process.stdout.readline().split()[0]
        with urllib.request.urlopen(url, timeout=60) as answer:
            assert b"avalanche_gym" in answer.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
    finally:
        process.kill()
        process.stdout.close()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nowhere"], "no 'nowhere' to show"),
        (["terrain", "--level", "hard"], "no levels"),
        (["--policy", "runs/none"], "does not belong to a training run"),
    ],
)
def test_what_cannot_be_shown_is_named(arguments, text, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["view", "--no-browser", "--port", "0", *arguments])
    assert stop.value.code == 1
    assert text in capsys.readouterr().err
