"""Generates docs/results.md, and the tables in README.md and docs/twins.md, from the results."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym

from training.results.result import Result, read_results
from training.results.results_tables import (
    by_kind,
    image_paths,
    over_seeds,
    readme_table,
    success_in_original,
    twins_table,
)
from training.settings.algorithms import SACConfig
from training.settings.config import TrainConfig
from training.settings.config_file import load_config
from training.settings.environment_ids import dense_id, plain_id
from training.settings.errors import UsageError

PAGE = Path("docs/results.md")
README = Path("README.md")
TWINS = Path("docs/twins.md")
NONE_YET = "No run is recorded yet. `rigid-envs results` records the finished runs in `runs/`."
HEAD = """\
# Results

Trained policies, each evaluated on episodes that it was not trained on, with its mean action.
`rigid-envs results` generates this page from the files in `results/`; these include the settings,
the learning curve and the policy of each row. Learning curves show the success of the mean action,
as the tables do; thin grey ones, or all of an older run, that of training episodes, whose actions
are sampled.

```sh
rigid-envs evaluate results/ppo/RigidEnvs-Push-v0_seed0/policy.safetensors  # measure a policy again
rigid-envs record results/ppo/RigidEnvs-Push-v0_seed0/policy.safetensors    # record a video of it
```

The commands below each table repeat the training. With the same commit, packages and kind of
machine they give the same policy, otherwise a similar one.

| column | meaning |
|---|---|
| seed | seed of training |
| steps | environment steps of training, summed over worlds |
| wall time | time of training, without compilation and evaluation |
| in environments | fraction of the wall time spent in the steps of the environments |
| success at the end | fraction of episodes whose goal is reached at the end |
| at any time | fraction of episodes whose goal is reached after any step |
| commit | git commit of the training code; -dirty: with changes that were not committed |

Intervals in parentheses are 95 % confidence intervals (Wilson). ± is the standard deviation over
seeds.
"""
_BLOCK = re.compile("(<!-- results -->\n).*?(<!-- /results -->)", re.DOTALL)


def page_text(results: Sequence[Result], repository: Path) -> str:
    """The text of docs/results.md, from results in the order of kind and seed."""
    if not results:
        return f"{HEAD}\n{NONE_YET}\n"
    sections = []
    for group in by_kind(results):
        first = group[0]
        file = first.folder(repository) / "config.yaml"
        sections.append(_section(group, load_config(first.algorithm, first.env_id, file)))
    return "\n".join([HEAD, *sections])


def readme_text(text: str, results: Sequence[Result]) -> str:
    """The text of README.md, with the table of results between its two markers.

    Twins are left out.

    Raises:
        UsageError: The text has no markers.
    """
    own = [one for one in results if one.original is None]
    return _with_block(README, text, readme_table(own) if own else f"{NONE_YET}\n")


def twins_text(text: str, results: Sequence[Result]) -> str:
    """The text of docs/twins.md, with the table of results of twins between its two markers.

    Raises:
        UsageError: The text has no markers.
    """
    twins = [one for one in results if one.original is not None]
    return _with_block(TWINS, text, twins_table(twins) if twins else f"{NONE_YET}\n")


def _with_block(path: Path, text: str, block: str) -> str:
    if not _BLOCK.search(text):
        raise UsageError(f"{path} has no lines <!-- results --> and <!-- /results -->")
    return _BLOCK.sub(lambda found: found[1] + block + found[2], text)


def write_pages(repository: Path) -> list[Path]:
    """Updates the page, the README and the page of twins.

    Returns:
        The files that have changed.

    Raises:
        UsageError: A result is damaged, or the README or the page of twins has no markers.
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
    """Raises UsageError if one of these pages is out of date, or a file is missing."""
    for path, text in _expected(repository).items():
        file = repository / path
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            raise UsageError(f"{path} is out of date; to generate it: rigid-envs results")
    for result in read_results(repository):
        images = [repository / path for path in image_paths(result.kind)]
        own = ("config.yaml", "progress.csv", "policy.safetensors")
        for file in [*images, *(result.folder(repository) / name for name in own)]:
            if not file.exists():
                raise UsageError(f"{file} is missing; to generate it: rigid-envs results")


def _expected(repository: Path) -> dict[Path, str]:
    """Text of the page, of the README and of the page of twins, by path in the repository."""
    results = read_results(repository)
    found = {PAGE: page_text(results, repository)}
    for path, text in ((README, readme_text), (TWINS, twins_text)):
        try:
            found[path] = text((repository / path).read_text(encoding="utf-8"), results)
        except OSError as error:
            raise UsageError(f"{repository / path} cannot be read: {error.strerror}") from None
    return found


def _section(group: Sequence[Result], settings: TrainConfig) -> str:
    """The section of a kind: its table, commands and images."""
    first = group[0]
    there = "" if first.original is None else f" in {first.original['env_id']} |"
    lines = [
        f"## {first.title}",
        "",
        _environment(first) + _first_stage(first, settings),
        "",
        "| seed | steps | wall time | in environments "
        f"| success at the end | at any time |{there} commit |",
        f"|---:|---:|---:|---:|---:|---:|{'---:|' if there else ''}---|",
    ]
    for one in group:
        original = f" {_interval(one.original['success_at_end'])} |" if one.original else ""
        lines.append(
            f"| {one.seed} | {one.steps:,} | {one.seconds:.0f} s | "
            f"{100 * one.environment_time_fraction:.0f} % | "
            f"{_interval(one.success_at_end)} | {_interval(one.success_at_any_time)} |{original} "
            f"{_short(one.commit)} |"
        )
    if len(group) > 1:
        cells = [
            over_seeds(group, lambda one: one.steps, "{:,.0f}"),
            over_seeds(group, lambda one: one.seconds, "{:.0f}", " s"),
            over_seeds(group, lambda one: 100 * one.environment_time_fraction, "{:.0f}", " %"),
            over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %"),
            over_seeds(group, lambda one: 100 * one.success_at_any_time["rate"], "{:.1f}", " %"),
            *([over_seeds(group, success_in_original, "{:.1f}", " %")] if there else []),
        ]
        lines.append(f"| mean | {' | '.join(cells)} | |")
    lines += ["", "```sh", *(one.command for one in group), "```", ""]
    if isinstance(settings, SACConfig) and settings.demonstrations is not None:
        lines += ["The page of the environment says how the demonstrations are recorded.", ""]
    lines += [*_grouped(group, _evaluation), *_grouped(group, _versions), ""]
    curve, video = (path.relative_to(PAGE.parent).as_posix() for path in image_paths(first.kind))
    lines += [f"![Learning curves of {first.kind}]({curve})", ""]
    lines += [f"![Three episodes of the policy of seed {first.seed}]({video})", ""]
    return "\n".join(lines)


def _environment(result: Result) -> str:
    """The sentence that names the environment of a section, by both of its ids if dense."""
    given, dense = _arguments(result.arguments), _dense_id_of(result)
    text = f"`{result.env_id}` with {given or 'its default arguments'}."
    if dense is None:
        return text
    return f"{text} `{dense}` is `{plain_id(dense)}` with `reward_type: dense` by default."


def _first_stage(result: Result, settings: TrainConfig) -> str:
    """The sentence on the arguments before the fine-tuning stage; empty without such a stage."""
    changed = {k: v for k, v in settings.env_kwargs.items() if v != result.arguments.get(k)}
    if not changed:
        return ""
    if not settings.finetune_timesteps:
        return f" Trained with {_arguments(changed)}."
    return (
        f" Trained with {_arguments(changed)} until the fine-tuning stage, which starts after "
        f"{settings.n_timesteps - settings.finetune_timesteps:,} steps or at the target."
    )


def _dense_id_of(result: Result) -> str | None:
    """The registered dense id of the environment, if the result has the dense reward."""
    dense = dense_id(result.env_id)
    has_it = result.env_id == dense or result.arguments.get("reward_type") == "dense"
    return dense if has_it and dense in gym.registry else None


def _arguments(values: Mapping[str, Any]) -> str:
    return ", ".join(f"`{name}: {value}`" for name, value in values.items())


def _grouped(group: Sequence[Result], text: Callable[[Result], str]) -> list[str]:
    """The text about each result, once if it is the same, otherwise after the seeds it is about."""
    seeds_by_text: dict[str, list[str]] = {}
    for one in group:
        seeds_by_text.setdefault(text(one), []).append(str(one.seed))
    if len(seeds_by_text) == 1:
        return list(seeds_by_text)
    return [f"Seed {', '.join(seeds)}: {line}" for line, seeds in seeds_by_text.items()]


def _evaluation(one: Result) -> str:
    times = "once" if one.resumed == 1 else f"{one.resumed} times"
    resumed = f" Training was resumed {times}." if one.resumed else ""
    return (
        f"Evaluated on {one.episodes:,} episodes with seeds from {one.first_seed:,}, "
        f"fidelity {one.fidelity or 'default'}.{resumed}"
    )


def _versions(one: Result) -> str:
    versions = {**one.versions}
    if isinstance(platform := versions.get("platform"), str):
        versions["platform"] = platform.partition("-")[0]  # without the build of the kernel
    return f"Trained with {', '.join(f'{name} {value}' for name, value in versions.items())}."


def _short(commit: str | None) -> str:
    if commit is None:
        return "–"
    digits, dash, dirty = commit.partition("-")
    return f"{digits[:10]}{dash}{dirty}"


def _interval(rate: dict[str, float]) -> str:
    low, middle, high = (f"{100 * rate[name]:.1f}" for name in ("low", "rate", "high"))
    return f"{middle} % ({low} to {high})"
