"""benchmarks.policies: a run that Ctrl-C ends is neither evaluated nor taken for finished."""

from dataclasses import replace

import pytest

from training.runs.run_folder import RunFolder
from training.sb3.train import TrainResult

policies = pytest.importorskip("benchmarks.policies")


def test_an_interrupted_run_is_resumed(tmp_path, monkeypatch):
    path = tmp_path / "push" / "run"
    path.mkdir(parents=True)
    result = TrainResult(RunFolder(path), 100, 0, 7.0, None, None, interrupted=True)
    config = policies.config_at("push", "fast")
    assert config.env_kwargs["fidelity"] == "fast"

    def train(*_, **__):
        (path / "config.yaml").write_text("")
        return result

    monkeypatch.setattr(policies, "train", train)
    with pytest.raises(KeyboardInterrupt):
        policies.trained(config, tmp_path / "push")
    monkeypatch.setattr(policies, "resume", lambda *_, **__: replace(result, interrupted=False))
    assert policies.trained(config, tmp_path / "push")[1] == 7.0
    monkeypatch.setattr(policies, "resume", None)  # no third time
    assert policies.trained(config, tmp_path / "push")[1] == 7.0
