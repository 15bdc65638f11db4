"""How policies carry over between fidelities: python -m benchmarks.policies [--train push ...].

Measures the success of every policy in results/ at every preset. With --train, a policy of each
task that is named is trained at every preset, with the settings of configs/ppo.yaml: rows are where
it was trained, columns where it acts. And training at "fast" that ends with a stage at "accurate"
is compared with training at "accurate" throughout: wall time, and success at "accurate". Runs are
kept in a folder, and a run that was interrupted resumes; what is measured is saved in
benchmarks/results.json.
"""

import argparse
from collections.abc import Callable
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.report.tables import Cell, Table, plain
from physics import PRESETS
from training.policies.policy import Policy
from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.results.result import read_results
from training.runs.run_folder import RunFolder
from training.sb3.model_state import read_state
from training.sb3.train import resume, train
from training.settings.config import TrainConfig
from training.settings.config_file import load_config
from training.settings.errors import UsageError

REPOSITORY = Path(__file__).parents[1]
EPISODES = 1000
# least steps of a last stage at another preset, as a fraction of those of a whole training
LAST_STAGE = 0.1
TASKS = ("push", "throw", "stack")


def _id(task: str) -> str:
    return f"RigidEnvs/{task.capitalize()}-v0"


def config_at(task: str, preset: str) -> TrainConfig:
    """The settings of a task, at one preset."""
    config = load_config("ppo", _id(task))
    return config.replace(env_kwargs={**config.env_kwargs, "fidelity": preset})


def finished_at(task: str, first: str, last: str) -> TrainConfig:
    """Training at one preset that ends with a stage at another one."""
    config = config_at(task, first)
    return config.replace(
        finetune_timesteps=max(int(LAST_STAGE * config.n_timesteps), config.finetune_timesteps),
        finetune_env_kwargs={**config.finetune_env_kwargs, "fidelity": last},
    )


def trained(config: TrainConfig, folder: Path) -> tuple[RunFolder, float]:
    """A finished run with these settings, and its wall time in s; trained or resumed if needed.

    Runs in the folder with other settings are left alone.

    Raises:
        KeyboardInterrupt: the training was interrupted.
    """
    runs = [RunFolder(file.parent) for file in folder.rglob("run.json")]
    same = [run for run in runs if run.checkpoints() and _has_settings(run, config)]
    for run in same:
        if (state := read_state(run.checkpoint))["finished"]:
            return run, float(state["seconds"])
    result = resume(same[-1], quiet=True) if same else train(config, folder, quiet=True)
    if result.interrupted:
        raise KeyboardInterrupt
    return result.folder, result.seconds


def _has_settings(run: RunFolder, config: TrainConfig) -> bool:
    try:
        return run.config() == config
    except UsageError:  # damaged, or of an older version
        return False


def success(policy: Policy, preset: str, episodes: int = EPISODES) -> float:
    """Fraction of episodes whose goal is met at the end, at a preset."""
    found = evaluate(policy, episodes, quiet=True, fidelity=preset)
    return float(found.success_at_end.mean())


def shipped() -> Table:
    """Success of the policies in results/: the seeds of a task share the episodes of a row."""
    rows: list[list[Cell]] = []
    for _, group in groupby(read_results(REPOSITORY), lambda result: result.kind):
        seeds = list(group)
        name = seeds[0].title.removeprefix("RigidEnvs/").replace("-v0", "")
        policies = [trained_policy(one.folder(REPOSITORY) / "policy.safetensors") for one in seeds]
        row: list[Cell] = [name, policies[0].env_kwargs["fidelity"]]
        for preset in PRESETS:
            try:
                rates = [success(one, preset, EPISODES // len(policies)) for one in policies]
                row.append(float(np.mean(rates)))
            except UsageError as error:  # as a mass that the substep of the preset does not allow
                row.append("–")
                print(error)
            print(name, preset, row[-1], flush=True)
        rows.append(row)
    columns = ["policy", "trained at", *(f"success at {name}" for name in PRESETS)]
    title = f"The policies in results/, {EPISODES:,} episodes divided among the seeds"
    return Table("policies", title, columns, rows)


def matrix(task: str, folder: Path) -> Table:
    """Success of the policies of a task."""
    rows: list[list[Cell]] = []
    for preset in PRESETS:
        run, seconds = trained(config_at(task, preset), folder / f"{task}_{preset}")
        rows.append(
            [preset, seconds, *(success(trained_policy(run.path), other) for other in PRESETS)]
        )
        print(task, *rows[-1], flush=True)
    columns = ["trained at", "s of training", *(f"success at {name}" for name in PRESETS)]
    title = f"{task.capitalize()}, PPO, {EPISODES:,} episodes"
    return Table(f"policies {task}", title, columns, rows)


def finishing(task: str, folder: Path) -> Table:
    """Training at "fast" and finishing at "accurate", against "accurate" throughout."""
    ways = {
        "accurate throughout": (config_at(task, "accurate"), f"{task}_accurate"),
        "fast, then accurate": (finished_at(task, "fast", "accurate"), f"{task}_fast_accurate"),
        "fast throughout": (config_at(task, "fast"), f"{task}_fast"),
    }
    rows: list[list[Cell]] = []
    for name, (config, place) in ways.items():
        run, seconds = trained(config, folder / place)
        rows.append([name, seconds, success(trained_policy(run.path), "accurate")])
        print(task, *rows[-1], flush=True)
    columns = ["trained at", "s of training", "success at accurate"]
    return Table(f"finishing {task}", f"{task.capitalize()}: where to train", columns, rows)


def main() -> None:
    """Prints and saves the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.policies", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--train", nargs="+", choices=TASKS, default=[], metavar="task",
                        help=f"train policies of it instead: {', '.join(TASKS)}")  # fmt: skip
    parser.add_argument("--folder", type=Path, default=Path("runs/policies"), help="of the runs")
    options = parser.parse_args()
    this_run = provenance()
    print(describe(this_run))
    makers: list[Callable[[], Table]] = [
        partial(make, task, options.folder)
        for task in options.train
        for make in (matrix, finishing)
    ]
    for make_table in makers or [shipped]:
        table = make_table()
        print(plain(table) + "\n", flush=True)
        save([table], this_run, keep=True)


if __name__ == "__main__":
    main()
