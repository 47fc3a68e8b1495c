"""Rules of the whole project: imports, start-up, package contents, promises of README."""

from __future__ import annotations

import ast
import os
import re
import stat
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from .programs import PATIENCE
from .sources import PACKAGE, ROOT, modules, nodes_of, tree_of, walked

README = (ROOT / "README.md").read_text(encoding="utf-8")
CI = ROOT / ".ci" / "run"

LOADED = """
import sys
from tui.__main__ import main
sys.argv = ["drivepanel", *sys.argv[1:]]
try:
    main()
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


def run(*command: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, timeout=PATIENCE * 5, check=False
    )


def test_imports_point_downward_only() -> None:
    done = run(sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"Contracts: [1-9]\d* kept, 0 broken", done.stdout), done.stdout


def imported(tree: ast.Module, package: str, names: frozenset[str]) -> Iterator[str]:
    """Yield the modules of `names` that a module imports: at its top, in functions, for types."""
    for node in walked(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: 1 - node.level or None] if node.level else []
            module = ".".join((*above, *([node.module] if node.module else [])))
            for alias in node.names:
                inner = f"{module}.{alias.name}"
                yield inner if inner in names else module


def circle(sources: Mapping[str, ast.Module], packages: frozenset[str] = frozenset()) -> list[str]:
    """Return modules that import each other in a circle, in its order; empty if there are none."""
    names = frozenset(sources)
    graph = {
        name: {*imported(tree, name if name in packages else name.rpartition(".")[0], names)}
        & names - {name}
        for name, tree in sources.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """An import inside a function, or for types only, is one as well."""
    sources = {path: ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in modules()}
    trees = {name.removesuffix(".__init__"): tree_of(path) for path, name in sources.items()}
    packages = frozenset(
        name.removesuffix(".__init__") for name in sources.values() if name.endswith(".__init__")
    )
    assert circle(trees, packages) == [], "move what both need into a module below them"


def test_each_module_is_imported_or_run() -> None:
    """Commands and registrations are imported by the names that lists have."""
    from tui.cli.command_index import COMMANDS
    from tui.screens.keys.table import PACKAGES, SCREENS

    by_name = {f"tui.screens.{package}.registration" for package in PACKAGES}
    by_name |= {f"tui.screens.{item.screen.rpartition('.')[0]}" for item in SCREENS}
    by_name |= {f"tui.cli.commands.{module}" for module, *_ in COMMANDS.values()}
    by_name |= {"tui.__main__", "tui.keeper.__main__", "tui.cli.derived", "tui.screens.keys.pages"}
    by_name.add("tui.bus.fake")  # for tests of scripts
    paths = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path
        for path in modules()
        if path.name != "__init__.py"
    }
    names = frozenset(paths)
    found: set[str] = set()
    for name, path in paths.items():
        found.update({*imported(tree_of(path), name.rpartition(".")[0], names)} - {name})
    for path in (PACKAGE / "__init__.py", *PACKAGE.rglob("__init__.py")):
        package = ".".join(path.parent.relative_to(ROOT).parts)
        found.update(imported(tree_of(path), package, names))
    assert sorted(names - found - by_name) == [], "take it out: the program does not reach it"


@pytest.mark.parametrize(
    "source",
    [
        "from .b import x",
        "from . import b",
        "import p.b",
        "from ..p.b import x",
        "def f():\n    from .b import x",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from p.b import x",
    ],
)
def test_import_circle_is_found(source: str) -> None:
    sources = {"p": "", "p.a": source, "p.b": "def g():\n    from .a import y"}
    trees = {name: ast.parse(text) for name, text in sources.items()}
    assert set(circle(trees, frozenset({"p"}))) == {"p.a", "p.b"}
    trees["p.b"] = ast.parse("x = 1")
    assert circle(trees, frozenset({"p"})) == []


def test_every_import_contract_of_the_design_is_configured() -> None:
    import tomli

    linter = tomli.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = next(c["layers"] for c in linter["contracts"] if c["type"] == "layers")
    parts = [p for p in (ROOT / "tui").iterdir() if p.is_dir() or p.suffix == ".py"]
    present = {f"tui.{part.stem}" for part in parts if not part.name.startswith("_")}
    named = {name.strip() for layer in layers for name in layer.split("|")}
    assert present <= named


def test_registered_screens_do_not_import_each_other() -> None:
    """A screen that the contract does not name is in the same layer as those that it names."""
    import grimp
    import tomli

    from tui.screens.keys.table import PACKAGES

    linter = tomli.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (layers,) = (c["layers"] for c in linter["contracts"] if "Layers of the screens" in c["name"])
    packages = {f"tui.screens.{package}" for package in PACKAGES}
    split = [{name.strip() for name in layer.split("|")} for layer in layers]
    at = next(at for at, layer in enumerate(split) if layer & packages)
    assert split[at] <= packages
    split[at] = packages
    found = grimp.build_graph("tui").find_illegal_dependencies_for_layers(tuple(split))
    assert {str(dependency) for dependency in found} == set()


@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["--help"], {"textual", "pymodbus", "serial", "rich", "msgspec", "tomli", "asyncio"}),
        (["--version"], {"textual", "pymodbus", "serial", "rich", "msgspec", "tomli", "asyncio"}),
        (["read", "--help"], {"textual", "pymodbus", "serial", "rich", "msgspec", "tomli"}),
        (["profiles"], {"textual", "pymodbus", "serial"}),
        (["ports"], {"textual", "pymodbus"}),
        (["read", "sim:atv71", "ETA", "--json"], {"textual", "rich"}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_command_imports_only_what_it_needs(arguments: list[str], unwanted: set[str]) -> None:
    done = run(sys.executable, "-c", LOADED, *arguments)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stderr.split())
    assert "tui" in loaded
    assert not loaded & unwanted


def test_panel_is_shown_before_line_modules_are_imported() -> None:
    start = (
        "import asyncio, gc, sys\n"
        "from tui.cli import opening\n"
        "from tui.app import DrivePanelApp\n"
        "async def first_picture():\n"
        "    gc.disable()\n"
        "    app = DrivePanelApp(on_shown=opening.collect_garbage)\n"
        "    async with app.run_test() as pilot:\n"
        "        await pilot.pause()\n"
        "        assert app.connection.query_one('#lines').option_count\n"
        "        assert gc.isenabled() and gc.get_freeze_count()\n"
        "        await pilot.press('space', 'f12', 'f9')\n"  # the stop keys still work
        "asyncio.run(first_picture())\n"
        "print(*sys.modules)\n"
        "ours = [m for n, m in list(sys.modules.items()) if n.startswith('tui.')]\n"
        "slow = {n for m in ours for n, one in vars(m).items() if isinstance(one, type)"
        " and one.__module__ == m.__name__ and '__dataclass_fields__' in vars(one)}\n"
        "print('data classes:', *slow)\n"
    )
    done = run(sys.executable, "-c", start)
    assert done.returncode == 0, done.stderr
    modules, _, data_classes = done.stdout.partition("data classes:")
    loaded = set(modules.split())
    assert "tui.screens.connection.screen" in loaded
    assert not loaded & {"pymodbus", "msgspec", "tui.bus.line", "tui.bus.link", "tui.simulator"}
    assert not loaded & {"click", "tui.screens.dialogs.question"}
    assert "tui.screens.frames.registration" in loaded
    screens = {name for name in loaded if re.fullmatch(r"tui\.screens\.\w+\.screen", name)}
    assert screens == {"tui.screens.connection.screen"}
    # creating one takes ten times as long as a named tuple
    assert set(data_classes.split()) <= {"OpenLine"}
    assert not loaded & {
        "tui.session.monitor.monitor",
        "tui.screens.monitor.screen",
        "tui.session.journal",
    }
    assert "tui.drive.profile.profile" not in loaded


def test_wheel_contains_tui_and_all_profiles_only(tmp_path: Path) -> None:
    build = "import sys; from hatchling.build import build_wheel; build_wheel(sys.argv[1])"
    done = run(sys.executable, "-c", build, str(tmp_path))
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith((".dist-info", ".data"))} == {"tui"}
    assert {n.partition("/")[2] for n in names if ".data/" in n} == {
        "data/share/man/man1/drivepanel.1"
    }
    profiles = {path.name for path in (ROOT / "profiles").glob("*.toml")}
    assert {Path(n).name for n in names if n.startswith("tui/_profiles/")} >= profiles
    styles = {path.relative_to(ROOT).as_posix() for path in (ROOT / "tui").rglob("*.tcss")}
    assert styles <= set(names)


def test_installed_wheel_works_in_another_folder(tmp_path: Path) -> None:
    build = "import sys; from hatchling.build import build_wheel; build_wheel(sys.argv[1])"
    assert run(sys.executable, "-c", build, str(tmp_path)).returncode == 0
    (wheel,) = tmp_path.glob("*.whl")
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(site)
    show = f"import sys; sys.path.insert(0, {str(site)!r}); import tui.drive.profile.library as l; "
    done = run(
        sys.executable,
        "-c",
        show + "print(l.packaged_folder()); print(*[i.id for i in l.listings()])",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    folder, ids = done.stdout.splitlines()
    assert Path(folder) == site / "tui" / "_profiles"
    assert set(ids.split()) == {path.stem for path in (ROOT / "profiles").glob("*.toml")}


def commands() -> list[str]:
    """Return the commands of README for a fresh clone, each one line."""
    return [line for line in README.splitlines() if line.startswith("python3 -m venv ")]


def test_readme_gives_one_command_to_start_and_one_to_test() -> None:
    start, test = commands()
    assert start.endswith(" && .venv/bin/drivepanel demo")
    assert ".venv/bin/python -m pytest" in test
    assert "'.[test]'" in test
    for command in (start, test):
        assert "-c constraints.txt" in command


def test_gate_runs_the_test_command_of_readme() -> None:
    script = CI.read_text(encoding="utf-8")
    assert CI.stat().st_mode & stat.S_IXUSR
    assert "set -euo pipefail" in script
    (extraction,) = re.findall(r"^command=\$\((.+)\)$", script, re.MULTILINE)
    done = run("bash", "-c", extraction)
    assert done.stdout.strip() == commands()[1]
    for check in ("ruff check", "ruff format --check", "mypy", "lint-imports", "DRIVEPANEL_PEERS"):
        assert check in script


def test_every_test_folder_is_run_by_one_of_two_commands() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    at_once = settings["tool"]["pytest"]["ini_options"]["testpaths"]
    folders = {f"tests/{found.parent.name}" for found in (ROOT / "tests").glob("*/test_*.py")}
    assert {*at_once} == {*(folders - {"tests/line"}), "tests/test_*.py"}
    layer = r"\.venv/bin/python -m pytest -q -n [0-9]+"
    assert re.search(rf"{layer} tests/line", README)
    assert "export DRIVEPANEL_PEERS=required" in CI.read_text("utf-8")
    assert re.search(rf"^layer {layer}.* tests/line$", CI.read_text("utf-8"), re.MULTILINE)


def test_gate_runs_tests_that_the_test_command_omits() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    options = settings["tool"]["pytest"]["ini_options"]
    assert options["addopts"].endswith(" -m 'not sweep and not long'")
    assert [marker.partition(":")[0] for marker in options["markers"]] == [
        "long",
        "sweep",
        "drawn",
        "internal_errors",
    ]
    layer, gate = r"\.venv/bin/python -m pytest -q -n [0-9]+", CI.read_text("utf-8")
    assert re.search(rf"{layer} -m sweep", README)
    assert "mapfile -t long < <(git grep -l 'mark\\.long' tests)\n" in gate
    for options in ('-m "long and not sweep" "${long[@]}"', '-m sweep --part "$part" tests'):
        assert re.search(rf"^ *layer {layer} .*{re.escape(options)}$", gate, re.MULTILINE)


def test_links_of_readme_exist() -> None:
    targets = [t for t in re.findall(r"\]\(([^)]+)\)", README) if "://" not in t]
    assert targets
    missing = [t for t in targets if not (ROOT / t).exists()]
    assert missing == []


def test_readme_names_every_profile_and_its_page_every_command() -> None:
    for path in (ROOT / "profiles").glob("*.toml"):
        assert f"`{path.stem}`" in README
    from tui.cli.command_index import COMMANDS

    assert "](docs/cli.md)" in README
    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert re.search(rf"^drivepanel {command}\b", page, re.MULTILINE), command


def test_readme_stays_short() -> None:
    """Install, strengths, five commands, safety, drives, links: the rest has pages of its own."""
    heads = re.findall(r"^## (.+)$", README, re.MULTILINE)
    assert heads == [
        "Install", "What sets it apart", "Common commands", "Safety",
        "Drives", "Documents", "License",
    ]  # fmt: skip
    assert len(README.splitlines()) <= 120
    five = README.partition("## Common commands")[2].partition("\n## ")[0]
    assert len(re.findall(r"^drivepanel ", five, re.MULTILINE)) == 5


def test_readme_links_to_every_page() -> None:
    pages = {f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")}
    pages |= {"docs/screens/README.md", "docs/decisions", "profiles/README.md"}
    targets = {target.partition("#")[0] for target in re.findall(r"\]\(([^)]+)\)", README)}
    assert pages - targets == set()


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    matches = [
        re.fullmatch(r"([A-Za-z0-9._-]+)==([A-Za-z0-9.!+]+)", line) for line in lines if line
    ]
    assert all(matches), "constraints.txt holds NAME==VERSION only"
    return {canonicalize_name(m[1]): m[2] for m in matches if m}


def test_every_required_package_is_pinned() -> None:
    import tomli

    project = tomli.loads((ROOT / "pyproject.toml").read_text())["project"]
    waiting = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    needed: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        requirement = Requirement(waiting.pop())
        extras = frozenset(requirement.extras)
        marker = requirement.marker
        key = (canonicalize_name(requirement.name), extras)
        if key in needed or (marker and not marker.evaluate({"extra": ""})):
            continue
        needed.add(key)
        for inner in metadata.requires(requirement.name) or []:
            wanted = Requirement(inner).marker
            if wanted is None or any(wanted.evaluate({"extra": e}) for e in ("", *extras)):
                waiting.append(inner.partition(";")[0])
    assert {name for name, _ in needed} - set(pins()) == set()


def test_values_become_text_in_one_place() -> None:
    """Screen, journal and command line use tui.drive.shown, which applies scales."""
    found = set()
    for path in modules():
        for node in nodes_of(path):
            if not isinstance(node, ast.ImportFrom) or not f".{node.module}".endswith(".values"):
                continue
            if any(name.name == "decode" for name in node.names):
                found.add(path.relative_to(ROOT / "tui").as_posix())
    assert found == {"drive/shown.py"}


def test_no_file_names_this_machine() -> None:
    listed = run("git", "ls-files")
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    home = re.compile(r"(?<![\w.])/(?:home|root|Users)/\w", re.ASCII)
    found = []
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix in {".svg", ".raw"} or not path.is_file():
            continue
        if home.search(path.read_text(encoding="utf-8", errors="replace")):
            found.append(name)
    assert found == []


def test_tests_do_not_use_the_user_folders(tmp_path: Path) -> None:
    for name in ("HOME", "DRIVEPANEL_CONFIG", "DRIVEPANEL_STATE"):
        assert Path(os.environ[name]).is_relative_to(tmp_path)


def test_hung_test_fails_and_the_run_continues(tmp_path: Path, pytestconfig: pytest.Config) -> None:
    assert 0 < float(pytestconfig.getini("timeout")) <= 600
    (tmp_path / "test_hanging.py").write_text(
        "import asyncio, threading\n"
        "def test_thread():\n"
        "    thread = threading.Thread(target=threading.Event().wait, daemon=True)\n"
        "    thread.start()\n"
        "    thread.join()\n"
        "async def test_loop():\n"
        "    await asyncio.Event().wait()\n"
        "def test_after_them():\n"
        "    pass\n"
    )
    command = [sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml")]
    command += ["--rootdir", str(tmp_path), "-p", "no:cacheprovider", "-o", "timeout=0.5"]
    done = run(*command, "test_hanging.py", cwd=tmp_path)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "2 failed, 1 passed" in done.stdout
    assert "FAILED test_hanging.py::test_thread" in done.stdout
    assert "FAILED test_hanging.py::test_loop" in done.stdout
