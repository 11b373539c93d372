"""A machine that installs what package.xml declares can import and run everything."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.conftest import ROOT

PACKAGES = sorted((ROOT / "src").glob("intent_*"))
ROSDEP = {
    "cv2": "python3-opencv",
    "joblib": "python3-joblib",
    "llvmlite": "python3-numba",
    "matplotlib": "python3-matplotlib",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "pandas": "python3-pandas",
    "rosbags": "python3-rosbags-pip",
    "scipy": "python3-scipy",
    "sklearn": "python3-sklearn",
    "trimesh": "python3-trimesh-pip",
    "yaml": "python3-yaml",
}
"""Keys of modules that rosdep installs; other modules have their own name or one of `PIP`."""
PIP = {"ai_edge_litert": "ai-edge-litert", "distributed": "dask", "open3d": "open3d-cpu"}
NUMPY_2 = {
    *(
        "acos",
        "acosh",
        "asin",
        "asinh",
        "astype",
        "atan",
        "atan2",
        "atanh",
        "bitwise_count",
        "bool",
    ),
    *("bitwise_invert", "bitwise_left_shift", "bitwise_right_shift", "concat", "cumulative_prod"),
    *("cumulative_sum", "isdtype", "long", "matrix_transpose", "matvec", "permute_dims", "pow"),
    *("strings", "trapezoid", "ulong", "unique_all", "unique_counts", "unique_inverse"),
    *("unique_values", "unstack", "vecdot", "vecmat"),
    *(f"linalg.{name}" for name in ("cross", "diagonal", "matmul", "matrix_norm", "outer")),
    *(f"linalg.{name}" for name in ("matrix_transpose", "svdvals", "tensordot", "trace")),
    *(f"linalg.{name}" for name in ("vecdot", "vector_norm")),
}
"""What numpy 1.26 of Ubuntu 24.04 lacks."""


def trees(package: Path) -> Iterator[tuple[Path, ast.Module]]:
    """Yield the sources of a package, its set-up aside."""
    for path in sorted(package.rglob("*.py")):
        if path.name != "setup.py":
            yield path, ast.parse(path.read_text(encoding="utf-8"))


def imported(tree: ast.AST) -> Iterator[str]:
    """Yield the top-level name of every module that is imported, at once or late."""
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "LateModule":
            names = [value.value for value in node.args if isinstance(value, ast.Constant)]
        yield from (name.partition(".")[0] for name in names)


def foreign(package: Path) -> set[str]:
    """Return the modules that a package imports, its own and Python's aside."""
    found = {name for _, tree in trees(package) for name in imported(tree)}
    return found - set(sys.stdlib_module_names) - {package.name}


def keys(package: Path) -> set[str]:
    """Return the dependencies that package.xml gives to rosdep."""
    root = ElementTree.parse(package / "package.xml").getroot()
    return {e.text or "" for kind in ("depend", "exec_depend") for e in root.findall(kind)}


def declared(package: Path) -> set[str]:
    """Return these, and the names that comments of package.xml give to pip."""
    text = (package / "package.xml").read_text(encoding="utf-8")
    comments = re.findall(r"<!--.*?brings:(.*?)-->", text, re.DOTALL)
    return keys(package) | {word for comment in comments for word in re.findall(r"[\w-]+", comment)}


def requirements(*names: str) -> set[str]:
    """Return the names of the packages in lists of requirements."""
    lines = [line for name in names for line in (ROOT / name).read_text().splitlines()]
    return {re.split(r"[=\[<>]", line)[0] for line in lines if line and not line.startswith("#")}


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: p.name)
def test_every_import_of_a_package_is_declared_in_its_package_xml(package: Path) -> None:
    known = declared(package)
    wanted = {name: ROSDEP.get(name) or PIP.get(name, name) for name in foreign(package)}
    assert {name: key for name, key in wanted.items() if key not in known} == {}


def test_what_pip_brings_stands_in_a_list_of_requirements() -> None:
    listed = requirements(*(path.name for path in ROOT.glob("requirements*.txt")))
    for package in PACKAGES:
        by_pip = foreign(package) - set(ROSDEP) - keys(package)
        assert {PIP.get(name, name) for name in by_pip} - listed <= {"ray"}


def test_what_a_robot_needs_beyond_rosdep_stands_in_the_list_for_colcon_workspaces() -> None:
    listed = requirements("requirements-rosdep.txt")
    for package in PACKAGES:
        used = {n for p, t in trees(package) if "workshop" not in p.parts for n in imported(t)}
        by_pip = (used & foreign(package)) - set(ROSDEP) - keys(package)
        # Modules of late imports, for an engine that is asked for and for making objects.
        assert {PIP.get(name, name) for name in by_pip} - listed <= {"pgmpy", "manifold3d"}


def test_set_up_for_the_demo_installs_nothing_that_no_package_imports() -> None:
    wanted = {
        PIP.get(name, ROSDEP.get(name, name).removeprefix("python3-").removesuffix("-pip"))
        for package in PACKAGES
        for name in foreign(package)
    }
    names = {"opencv": "opencv-python-headless", "sklearn": "scikit-learn", "yaml": "pyyaml"}
    imports = {names.get(name, name) for name in wanted} | {"networkx"}  # trimesh's graphs
    assert requirements("requirements.txt") - imports == set()
    assert not requirements("requirements.txt") & requirements("requirements-dev.txt")


def only_numpy_2(node: ast.AST) -> str:
    """Return what a node uses that numpy 1.26 lacks or takes otherwise, "" if nothing."""
    if isinstance(node, ast.Attribute):
        name = ast.unparse(node)
        newer = name.startswith("np.") and name.removeprefix("np.") in NUMPY_2
        return name if newer or name.endswith(".mT") else ""
    if not isinstance(node, ast.Call):
        return ""
    called, options = ast.unparse(node.func), {option.arg for option in node.keywords}
    if called.startswith("np.save") and "allow_pickle" in options:
        return f"{called}(allow_pickle)"
    if called == "np.linalg.lstsq" and "rcond" not in options:  # another default there
        return f"{called} without rcond"
    return ""


def test_no_name_is_used_that_only_numpy_2_has() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {name}"  # type: ignore[attr-defined]
        for folder in (*PACKAGES, ROOT / "tests", ROOT / "examples")
        for path, tree in trees(folder)
        for node in ast.walk(tree)
        if (name := only_numpy_2(node))
    ]
    assert found == []
