"""Scripts that strangers wrote for Fetch and Panda environments, run on twins.

Each is fetched from GitHub into a temporary folder and changed in two ways only: ids of
environments become those of twins, and `rigid_envs` stands where the original's package was
imported or registered. A script that would go on is stopped after 10,000 steps of the environment.
"""

import os
import re
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

RUNNER = Path(__file__).with_name("script_runner.py")
STEPS = 10_000
COUNTED = r"[\d,]+ steps"  # what the runner prints
ARCHIVE = "https://codeload.github.com/{repository}/tar.gz/{commit}"


class Script(NamedTuple):
    """A script.

    Attributes:
        repository: owner and name, on GitHub.
        commit: of the version that is run.
        path: of the script, in the repository.
        arguments: of the command line.
        module: whether it is run as a module, from the repository's folder.
        needs: packages beyond those of this project.
    """

    repository: str
    commit: str
    path: str
    arguments: tuple[str, ...] = ()
    module: bool = False
    needs: tuple[str, ...] = ()


SCRIPTS = (
    # SAC and HER of Stable-Baselines3, FetchReach
    Script(
        "Clihef/fetch-sac-her-robotics", "47812e53c05876e0ff71bcb1d373952da5d3cb4e",
        "scripts/train_fetch_sac_her.py",
    ),
    # its own TD3 and HER, PandaPush, in an AsyncVectorEnv
    Script(
        "CodeKnight314/Goal-Conditioned-RL-Framework", "612753c0b044ec8ee1e94843f20499a5addebe7b",
        "src/main.py",
        ("--id", "push", "--c", "src/config/TD3/config_td3_push.yaml", "--o", "out", "--agent",
         "TD3", "--her", "--no-wandb", "--nenv", "2"),
        module=True, needs=("wandb", "opencv-python-headless"),
    ),
    # its own PPO, FetchPickAndPlace
    Script(
        "sayanpr8175/fetchpickandplace-rl", "a929d8e9b0de7260c8257f0721a883f998a734ac",
        "PPO_training.py",
    ),
    # A2C of Stable-Baselines3, PandaReachDense
    Script(
        "pietroluongo/pg-relearn", "1195672a02e7b30cf933cd8ca89688ccdb065b29",
        "RoboticArm/train.py",
    ),
    # SAC and HER of Stable-Baselines3, PandaPickAndPlace, in a SubprocVecEnv
    Script(
        "shashwat-2161/Deep-RL-Robotic-Manipulation", "3057c1181417f61f1c6324e3a748ca2d1465657c",
        "train_pick_place.py",
    ),
)  # fmt: skip

SUBSTITUTIONS = (
    (r"\b(Fetch(?:Reach|Push|Slide|PickAndPlace)(?:Dense)?)-v\d+\b", r"RigidEnvs/\1-v0"),
    (r"\b(Panda(?:Reach|Push|Slide|PickAndPlace|Stack)(?:Dense)?)-v\d+\b", r"RigidEnvs/\1-v0"),
    (r"(?m)^(\s*)import (?:gymnasium_robotics|panda_gym)\b", r"\1import rigid_envs"),
    (r"register_envs\((?:gymnasium_robotics|panda_gym)\)", "register_envs(rigid_envs)"),
)


def changed(text: str) -> str:
    """A script's text for twins."""
    for pattern, new in SUBSTITUTIONS:
        text = re.sub(pattern, new, text)
    return text


def run(script: Script) -> tuple[int, str]:
    """Exit status of a script, and how many steps it took, or else the last line printed."""
    with tempfile.TemporaryDirectory() as place:
        folder = fetch(script, Path(place))
        for file in folder.rglob("*.py"):
            text = file.read_text(encoding="utf-8", errors="surrogateescape")
            file.write_text(changed(text), encoding="utf-8", errors="surrogateescape")
        command = [sys.executable, str(RUNNER), str(STEPS)]
        command += ["-m", script.path[:-3].replace("/", ".")] if script.module else [script.path]
        done = subprocess.run(
            [*command, *script.arguments], cwd=folder, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env={**os.environ, "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
    lines = done.stdout.strip().split("\n")
    return done.returncode, next((line for line in lines if re.fullmatch(COUNTED, line)), lines[-1])


def fetch(script: Script, place: Path) -> Path:
    """Unpacks the repository's files; returns their folder."""
    url = ARCHIVE.format(repository=script.repository, commit=script.commit)
    with urllib.request.urlopen(url) as reply:
        archive = tarfile.open(fileobj=BytesIO(reply.read()))  # noqa: SIM115
    with archive:
        archive.extractall(place, filter="data")
    (folder,) = place.iterdir()
    return folder


def table() -> Iterator[str]:
    """A line for each script, once it has ended."""
    for script in SCRIPTS:
        status, last = run(script)
        outcome = last if status == 0 else f"exit status {status}: {last}"
        needs = f" (needs {', '.join(script.needs)})" if script.needs and status else ""
        yield f"{script.repository} {script.path}: {outcome}{needs}"
