"""docs/results.md and the table of the README: text made of the results, and of nothing else."""

import re
import statistics
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import gymnasium as gym

from training.results.result import Result, read_results
from training.runs.run_folder import folder_name
from training.settings.config import TrainConfig, load_config
from training.settings.errors import UsageError

PAGE = Path("docs/results.md")
README = Path("README.md")
PICTURES = Path("docs/results")
NONE_YET = (
    "No run is recorded yet: `rigid-envs results` records those that are finished under `runs/`."
)
HEAD = """\
# Results

Trained policies on the environments, each evaluated on episodes that it was not trained on, acting
by its mean. `rigid-envs results` writes this page from the files under `results/`; the settings,
the learning curve and the policy of every row lie there too. `rigid-envs evaluate
results/<algo>/<run>/policy.policy` measures one again, `rigid-envs record` films it, and the
command below a table trains it anew: to the same policy with the commit and packages of then on
the same kind of machine, to much the same with others.

Wall time is that of training alone, without compiling what was compiled before and without
evaluation; the share in the environments is what their steps took of it. Success at the end counts
episodes whose goal is met when they end, success at any time those that met it after some step;
intervals are Wilson's at 95 %. ± is the standard deviation over seeds.
"""
README_WIDTH = 200
"""Of a picture in the README, in pixels."""
_PLACE = re.compile("(<!-- results -->\n).*?(<!-- /results -->)", re.DOTALL)


def page_text(results: Sequence[Result], repository: Path) -> str:
    """The whole of docs/results.md, of results by kind and seed, and their settings."""
    if not results:
        return f"{HEAD}\n{NONE_YET}\n"
    sections = []
    for group in by_kind(results):
        one = group[0]
        file = one.folder(repository) / "config.yaml"
        sections.append(_section(group, load_config(one.algorithm, one.env_id, file)))
    return "\n".join([HEAD, *sections])


def readme_text(text: str, results: Sequence[Result]) -> str:
    """README's text with the table of the results in its place.

    Raises:
        UsageError: The text has no place for it.
    """
    if not _PLACE.search(text):
        raise UsageError(f"{README} has no lines <!-- results --> and <!-- /results -->")
    block = _summary(results) if results else f"{NONE_YET}\n"
    return _PLACE.sub(lambda found: found[1] + block + found[2], text)


def by_kind(results: Sequence[Result]) -> list[list[Result]]:
    """The results that differ by their seed only, together."""
    return [list(group) for _, group in groupby(results, key=lambda result: result.kind)]


def pictures(kind: str) -> tuple[Path, Path]:
    """Learning curve and film of a kind, in the repository."""
    return PICTURES / f"{kind}.png", PICTURES / f"{kind}.gif"


def write_pages(repository: Path) -> list[Path]:
    """Brings the page and the README up to date.

    Returns:
        Those that were other before.

    Raises:
        UsageError: A result is damaged, or the README has no place for its table.
    """
    written = []
    for path, text in _expected(repository).items():
        file = repository / path
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
            written.append(path)
    return written


def check_pages(repository: Path) -> None:
    """Raises UsageError where the page or the README is out of date, or a file is missing."""
    for path, text in _expected(repository).items():
        file = repository / path
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            raise UsageError(f"{path} is not what the files under results/ say: rigid-envs results")
    for result in read_results(repository):
        needed = [repository / path for path in pictures(result.kind)]
        own = ("config.yaml", "progress.csv", "policy.policy")
        for file in [*needed, *(result.folder(repository) / name for name in own)]:
            if not file.exists():
                raise UsageError(f"{file} is missing: rigid-envs results")


def _expected(repository: Path) -> dict[Path, str]:
    """Text of the page and of the README by their path in the repository."""
    results = read_results(repository)
    try:
        readme = (repository / README).read_text(encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{repository / README} cannot be read: {error.strerror}") from None
    return {PAGE: page_text(results, repository), README: readme_text(readme, results)}


def _arguments(values: Mapping[str, Any]) -> str:
    return ", ".join(f"`{name}: {value}`" for name, value in values.items())


def _section(group: Sequence[Result], settings: TrainConfig) -> str:
    """A task and algorithm: its table, commands, pictures."""
    first, given = group[0], _arguments(group[0].arguments)
    begun = {k: v for k, v in settings.env_kwargs.items() if v != first.arguments.get(k)}
    before = (
        f" Trained with {_arguments(begun)} until the last part, of {settings.finish_timesteps:,} "
        "steps."
        if begun
        else ""
    )
    lines = [
        f"## {first.env_id}, {first.algorithm.upper()}",
        "",
        (f"With {given}." if given else "With the environment's own arguments.") + before,
        "",
        "| seed | steps | wall time | in environments "
        "| success at the end | at any time | commit |",
        "|---:|---:|---:|---:|---:|---:|---|",
    ]
    for one in group:
        lines.append(
            f"| {one.seed} | {one.steps:,} | {one.seconds:.0f} s | "
            f"{100 * one.environment_share:.0f} % | "
            f"{_interval(one.success_at_end)} | {_interval(one.success_at_any_time)} | "
            f"{_short(one.commit)} |"
        )
    if len(group) > 1:
        cells = [
            _over_seeds(group, lambda one: one.steps, "{:,.0f}"),
            _over_seeds(group, lambda one: one.seconds, "{:.0f}", " s"),
            _over_seeds(group, lambda one: 100 * one.environment_share, "{:.0f}", " %"),
            _over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %"),
            _over_seeds(group, lambda one: 100 * one.success_at_any_time["rate"], "{:.1f}", " %"),
        ]
        lines.append(f"| mean | {' | '.join(cells)} | |")
    lines += ["", "```sh", *(one.command for one in group), "```", ""]
    lines += [*_circumstances(group), ""]
    curve, film = (path.relative_to(PAGE.parent).as_posix() for path in pictures(first.kind))
    lines += [f"![Learning curves of {first.kind}]({curve})", ""]
    lines += [f"![Three episodes of the policy of seed {first.seed}]({film})", ""]
    return "\n".join(lines)


def _circumstances(group: Sequence[Result]) -> list[str]:
    """How the runs were evaluated and what with they were made, each said once."""
    lines = []
    for text in (_evaluation, _made_with):
        for said, seeds in _alike(group, text).items():
            which = "" if len(seeds) == len(group) else f"Seed {', '.join(seeds)}: "
            lines.append(f"{which}{said}")
    return lines


def _alike(group: Sequence[Result], text: Callable[[Result], str]) -> dict[str, list[str]]:
    """Seeds by what is said of them."""
    said: dict[str, list[str]] = {}
    for one in group:
        said.setdefault(text(one), []).append(str(one.seed))
    return said


def _evaluation(one: Result) -> str:
    resumed = f" Training was resumed {one.resumed} times." if one.resumed else ""
    return (
        f"Evaluated on {one.episodes:,} episodes from seed {one.first_seed:,} on, "
        f"fidelity {one.fidelity or 'as the environment has it'}.{resumed}"
    )


def _made_with(one: Result) -> str:
    versions = {**one.versions}
    if isinstance(platform := versions.get("platform"), str):
        versions["platform"] = platform.partition("-")[0]  # the kernel's build says nothing here
    return f"Made with {', '.join(f'{name} {value}' for name, value in versions.items())}."


def _summary(results: Sequence[Result]) -> str:
    """The table of environments in the README: sizes, and results by algorithm."""
    algorithms = list(dict.fromkeys(one.algorithm for one in results))
    columns = ["environment", "", "observation", "action", "steps per episode"]
    for algorithm in algorithms:
        columns += [f"{algorithm.upper()}: success", "training time"]
    lines = [" | ".join(columns), " | ".join(["---", "---", *["---:"] * (len(columns) - 2)])]
    environments: dict[str, list[list[Result]]] = {}
    for group in by_kind(results):
        environments.setdefault(_environment(group[0]), []).append(group)
    for groups in environments.values():
        first = groups[0][0]
        names = dict.fromkeys(_name(group[0]) for group in groups)
        cells = ["<br>".join(names), _image(first), *_sizes(first.env_id)]
        by_algorithm = {group[0].algorithm: group for group in groups}
        for algorithm in algorithms:
            cells += _outcome(by_algorithm.get(algorithm, []))
        lines.append(" | ".join(cells))
    return "\n".join([*(f"| {line} |" for line in lines), ""])


def _environment(one: Result) -> str:
    """A key that is the same for the sparse and the dense id of a task."""
    task = gym.spec(one.env_id).kwargs.get("task", one.env_id)
    return f"{task} {_changes(one)}"


def _name(one: Result) -> str:
    return f"{one.env_id} {_changes(one)}".strip()


def _changes(one: Result) -> str:
    """The arguments that make it another task."""
    return one.task.removeprefix(folder_name(one.env_id)).removeprefix("-")


def _image(one: Result) -> str:
    film = pictures(one.kind)[1].as_posix()
    return f'<img src="{film}" width="{README_WIDTH}" alt="{one.env_id}">'


def _sizes(env_id: str) -> list[str]:
    """Sizes of observation and action, and the steps of an episode."""
    env = gym.make(env_id)
    spaces: Any = env.observation_space, env.action_space
    env.close()
    observation, action = spaces[0]["observation"].shape[0], spaces[1].shape[0]
    return [str(observation), str(action), str(gym.spec(env_id).max_episode_steps)]


def _outcome(group: Sequence[Result]) -> list[str]:
    """Success at the end and training time of runs that differ by their seed; of none, dashes."""
    if not group:
        return ["–", "–"]
    success = _over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %")
    if statistics.fmean(one.seconds for one in group) < 100:
        return [success, _over_seeds(group, lambda one: one.seconds, "{:.0f}", " s")]
    return [success, _over_seeds(group, lambda one: one.seconds / 60, "{:.1f}", " min")]


def _short(commit: str | None) -> str:
    if commit is None:
        return "–"
    digits, dash, dirty = commit.partition("-")
    return f"{digits[:10]}{dash}{dirty}"


def _interval(share: dict[str, float]) -> str:
    low, rate, high = (f"{100 * share[name]:.1f}" for name in ("low", "rate", "high"))
    return f"{rate} % ({low} to {high})"


def _over_seeds(
    group: Sequence[Result], value: Callable[[Result], float], form: str, unit: str = ""
) -> str:
    """Mean ± standard deviation; of a single seed its value."""
    values = [value(one) for one in group]
    mean = form.format(statistics.fmean(values))
    if len(values) == 1:
        return f"{mean}{unit}"
    return f"{mean} ± {form.format(statistics.stdev(values))}{unit}"
