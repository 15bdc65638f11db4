"""Another numba than those that work is named when the package is imported."""

import re
from pathlib import Path

import pytest

from physics.compiler import versions


@pytest.mark.parametrize("version", ["0.61.2", "0.69.0", "0.70.0rc1", "1.0"])
def test_a_version_that_does_not_work_is_named(version):
    asked = (
        r'rigid-envs needs at least 0\.62 and less than 0\.69: pip install "numba>=0\.62,<0\.69"'
    )
    with pytest.raises(ImportError, match=f"numba {re.escape(version)} is installed, but {asked}"):
        versions.check_numba(version)


@pytest.mark.parametrize("version", ["0.62.0", "0.62.1", "0.68.1", "0.68.0dev0"])
def test_versions_that_work_pass(version):
    versions.check_numba(version)


def test_the_range_is_that_of_the_package():
    text = (Path(versions.__file__).parents[2] / "pyproject.toml").read_text()
    first, beyond = (".".join(map(str, bound)) for bound in (versions.FIRST, versions.BEYOND))
    assert f'"numba>={first},<{beyond}"' in text
