"""Runs that are interrupted, for tests of what resumes them."""

from stable_baselines3.common.callbacks import BaseCallback

from training.runs.run_folder import RunFolder
from training.sb3 import train as train_module
from training.sb3.progress import TrainingProgress
from training.sb3.train import train


def stopping(monkeypatch, after: int, error: BaseException) -> None:
    """Makes training fail after more than the given number of steps."""

    class Stop(BaseCallback):
        def _on_step(self) -> bool:
            if self.num_timesteps > after:
                raise error
            return True

    monkeypatch.setattr(train_module, "TrainingProgress", with_stop(Stop))


def with_stop(stop: type[BaseCallback]):
    """The progress display, with a callback that fails."""

    class Both(TrainingProgress):
        def _on_step(self) -> bool:
            return super()._on_step() and stop._on_step(self)

    return Both


def interrupted(config, tmp_path, monkeypatch, after, error=KeyboardInterrupt) -> RunFolder:
    """A run that an error ended after more than the given number of steps."""
    with monkeypatch.context() as patched:
        stopping(patched, after, error())
        try:
            return aged(train(config, tmp_path, save_every=80, quiet=True).folder)
        except RuntimeError:
            return aged(RunFolder(tmp_path / config.algo / "Test-Reach-v0_1"))


def aged(folder: RunFolder) -> RunFolder:
    """As if it had begun 9 s earlier.

    Files of events have names by the second, and `resume` waits for another one.
    """
    for path in folder.path.glob("events.out.tfevents.*"):
        parts = path.name.split(".")
        parts[3] = f"{int(parts[3]) - 9:010d}"
        path.rename(path.with_name(".".join(parts)))
    return folder
