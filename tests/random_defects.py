"""Plants defects at random, and runs the tests that reach the changed lines.

`python -m tests.mutants --random N --seed S` is its command; tests/README.md describes it.
"""

from __future__ import annotations

import argparse
import ast
import json
import random
import re
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from functools import cache, cached_property
from itertools import islice, zip_longest
from pathlib import Path

import pytest

from tests import reached
from tests.defects.equivalent import EQUIVALENT
from tests.forked import HUNG, LONGEST, Forks
from tests.mutants import SURVIVED, copies, dealt, replaced, run_tests
from tests.mutator import Defaults, Mutant, Mutator, Site
from tests.sources import PACKAGE, ROOT, modules, tree_of
from tests.swapped import NotSwapped

PACKAGES = ("bus", "keeper", "session", "drive", "cli", "screens")
LEAST = 0.92
"""The share of defects that must be noticed; on the way of a stop, all."""
MOST_TESTS = 60, 80
"""Tests that are run for one defect, and as many more if none of them fails."""
MOST_ALIKE = 3
"""Tests of one function with other parameters that are run for one defect, if there are others."""
MOST_QUICK, QUICK = 100, 0.02
"""More tests that run first: those of files that name the module and take at most so many seconds.

Of a function with parameters, the few that were chosen may not be those that notice a defect.
"""
MOST_SECONDS = 40.0, 40.0
"""Time of these tests, as recorded."""
TABLES = "tests/test_tables.py::test_constants_and_tables_are_the_recorded_ones"
"""The test of what a package fixes at import."""
MOST_BY_NAME = 24
"""Test functions that are run because they share names with the line, whatever is recorded."""
MOST_ON_TERMINALS = 3
"""Of these, tests of `line/`: they take seconds each, and reach code in processes of its own."""
FOLDERS = {"screens": "ui", "keeper": "session"}
"""By package: the folder of its tests, if it has another name."""
LAST_RUN = Path(tempfile.gettempdir()) / "drivepanel-random-defects.json"
NOT_RECORDED = {
    "tui/keeper/*": (
        "tests/session/test_keeper_end.py",
        "tests/line/test_keeper.py",
        "tests/line/test_hung_keepers.py",
    ),
    "tui/bus/*": ("tests/bus/test_whole_state.py", "tests/bus/test_whole_values.py"),
    "tui/drive/*": (
        "tests/drive/test_whole_values.py",
        "tests/drive/test_whole_files.py",
        "tests/drive/test_whole_profile.py",
        "tests/drive/test_library.py::test_committed_schema_is_up_to_date",
    ),
    "tui/cli/*": (
        "tests/cli/test_recorded_refusals.py",
        "tests/cli/test_recorded_outputs.py",
    ),
    "tui/cli/commands/[brc]*.py": (
        "tests/cli/test_recorded_scenes.py::test_outputs_of_commands_in_turn_are_the_recorded_ones"
        "[restoring]",
        "tests/cli/test_recorded_scenes.py::test_outputs_of_commands_in_turn_are_the_recorded_ones"
        "[recipes]",
    ),
    "tui/cli/commands/profiles.py": (
        "tests/cli/test_recorded_scenes.py::test_outputs_of_commands_in_turn_are_the_recorded_ones"
        "[own-profiles]",
    ),
    "tui/cli/derived.py": ("tests/cli/test_derived.py",),
    "tui/screens/*/registration.py": ("tests/ui/test_key_pages.py", "tests/ui/test_palette.py"),
    "tui/screens/blocks/registration.py": ("tests/ui/test_block_pictures.py",),
    "tui/screens/connection/registration.py": ("tests/ui/test_line_pictures.py",),
    "tui/screens/frames/registration.py": ("tests/ui/test_frame_pictures.py",),
    "tui/screens/monitor/registration.py": ("tests/ui/test_monitor_pictures.py",),
    "tui/screens/parameters/registration.py": ("tests/ui/test_parameter_pictures.py",),
    "tui/screens/keys/*": ("tests/ui/test_key_pages.py",),
}
"""By the pattern of a path: tests of code that runs in processes of its own, or at import only."""
BY_SOURCE = {
    r"\bwith self\._|Thread\(|\.spawn\(": "tests/test_locks.py",
    r"\blog\.\w+\(": "tests/test_texts.py::test_each_log_text_fits_its_values",
}
"""By lines on locks, threads, workers and the log: tests that check them in the source."""
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/.*)$", re.MULTILINE)
UNREACHED, EQUAL = "NOT REACHED", "EQUIVALENT"


@dataclass(frozen=True, slots=True)
class Judged:
    """The result of one random defect."""

    identity: str
    package: str
    line: int
    noticed_by: str
    """The test that failed, or SURVIVED, NOT REACHED, EQUIVALENT."""
    seconds: float
    tests: int

    @property
    def noticed(self) -> bool:
        """True if a test failed because of it, and only because of it."""
        return self.noticed_by not in (SURVIVED, UNREACHED, EQUAL)


# -- which defects ---------------------------------------------------------------------------------


def all_sites(package: str, defaults: Defaults) -> Iterator[Site]:
    """All that can be changed in a package of the product."""
    for path in modules(PACKAGE / package):
        name = path.relative_to(ROOT).as_posix()
        yield from Mutator(name, path.read_text("utf-8"), defaults).sites()


def sample(sites: dict[str, list[Site]], number: int, seed: int) -> list[Mutant]:
    """So many defects, as many of each package, each site with the same chance."""
    chance = random.Random(seed)
    orders = [chance.sample(sites[package], len(sites[package])) for package in sorted(sites)]
    in_turn = (site for turn in zip_longest(*orders) for site in turn if site is not None)
    return [chance.choice(site.mutants) for site in islice(in_turn, number)]


def stop_path() -> set[tuple[str, str]]:
    """Module path and qualified name of each function that a stop passes through, traced now."""
    from tests.session.test_stop_faults import Wire, passed

    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        for name in ("CONFIG", "STATE", "SHARE_FOLDER"):
            patch.setenv(f"DRIVEPANEL_{name}", str(Path(folder, name.lower())))
        patch.setattr("tui.bus.share.keeping.can_start", lambda: False)
        wire = Wire()
        places = set()
        for attached in (False, True):
            own = Path(folder, f"attached-{attached}")
            own.mkdir()
            places |= set(passed(wire, attached, own))
        wire.simulation.stop()
    return {(f"{place.module.replace('.', '/')}.py", place.name) for place in places}


# -- which tests -----------------------------------------------------------------------------------


class Uses:
    """Modules that use names of a module: code that runs at import has its effect there."""

    @cached_property
    def _importers(self) -> dict[str, set[Path]]:
        """By module path: the modules that import something of it."""
        found: dict[str, set[Path]] = defaultdict(set)
        for path in modules():
            package = path.relative_to(ROOT).parent.parts
            for node in ast.walk(tree_of(path)):
                if isinstance(node, ast.ImportFrom):
                    above = package[: len(package) + 1 - node.level] if node.level else ()
                    parts = (*above, *(node.module or "").split("."))
                    for alias in ("", *(imported.name for imported in node.names)):
                        found["/".join(filter(None, (*parts, alias))) + ".py"].add(path)
        return found

    def importers(self, path: str) -> list[Path]:
        """The module itself, and those that import of it."""
        return [ROOT / path, *sorted(self._importers[path] - {ROOT / path})]

    def lines(self, path: str, names: Iterable[str], depth: int = 3) -> set[tuple[str, int]]:
        """Lines of functions in which names of a module are used, directly or through others."""
        found: set[tuple[str, int]] = set()
        for user in self.importers(path) if depth else ():
            name_of_user = user.relative_to(ROOT).as_posix()
            used = [use for use in _used_names(user) if use[0] in names]
            found.update((name_of_user, line) for _, line, bound in used if bound is None)
            further = {name for _, _, bound in used for name in bound or ()} - set(names)
            if further:
                found |= self.lines(name_of_user, further, depth - 1)
        return found


@cache
def _used_names(path: Path) -> list[tuple[str, int, tuple[str, ...] | None]]:
    """Names read in a module with their lines; outside functions, the names bound by them."""
    found: list[tuple[str, int, tuple[str, ...] | None]] = []

    def walk(node: ast.AST, bound: tuple[str, ...] | None) -> None:
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
                bound = None
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                bound = bound if bound is None else (name,)
            case ast.ClassDef(name=name):
                bound = bound if bound is None else (name,)
            case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name):
                found.append((name, node.lineno, bound))
        for child in ast.iter_child_nodes(node):
            walk(child, bound)

    walk(tree_of(path), ())
    return found


class Chooser:
    """Chooses the tests that may notice a defect, by what was recorded."""

    def __init__(self, record: reached.Record) -> None:
        self._record = record
        self._uses = Uses()
        self._usable = {
            name for name, reach in record.tests.items() if reach.passed and _exists(name)
        }
        self._recorded = {name.partition("[")[0] for name in record.tests}

    def tests(self, mutant: Mutant) -> list[list[str]]:
        """The tests to run, those most about the changed line first, and those to run then."""
        first, then = self._best(self._reaching(mutant) & self._usable, mutant)
        for pattern, others in NOT_RECORDED.items():
            if fnmatch(mutant.path, pattern):
                first += others
        line = _text(mutant.path).splitlines()[mutant.line - 1]
        first += (test for pattern, test in BY_SOURCE.items() if re.search(pattern, line))
        tables = [] if mutant.lines else [f"{TABLES}[{mutant.path.split('/')[1]}]"]
        return [part for part in (tables, first, then, self._by_name(mutant)) if part]

    def is_reached(self, mutant: Mutant) -> bool:
        """True if a recorded test reaches the changed line."""
        return bool(self._reaching(mutant) & self._usable)

    def _by_name(self, mutant: Mutant) -> list[str]:
        """Test functions that name the module or share names with the line.

        Those that were not recorded; if no recorded test reaches the line, any. The record may be
        older than the code, and does not follow processes that a test starts.
        """
        left = self._recorded if self.is_reached(mutant) else set()
        line = _text(mutant.path).splitlines()[mutant.line - 1]
        words = _pieces(" ".join((line, mutant.function, *mutant.names, Path(mutant.path).stem)))
        module = mutant.path.removesuffix(".py").replace("/", ".")
        ranked = []
        for file in _test_files():
            near = 0.2 * (module in _text(file)) + 0.1 * _shared_words(mutant.path, file)
            for name, names in _pieces_by_function(file).items():
                if name.startswith("test_") and f"{file}::{name}" not in left:
                    # names that few tests have say most
                    score = near + sum(1 / _tests_with()[word] for word in words & names)
                    ranked.append((-score, f"{file}::{name}"))
        best = [name for score, name in sorted(ranked) if score < -0.01]
        main = [name for name in best if not name.startswith("tests/line/")]
        others = [] if left else [name for name in best if name.startswith("tests/line/")]
        return _spread(main[: 4 * MOST_BY_NAME])[:MOST_BY_NAME] + others[:MOST_ON_TERMINALS]

    def runs_at_import(self, mutant: Mutant) -> bool:
        """True if a fork, which begins after all imports, would not run it again."""
        lines = self._record.lines(mutant.path)
        return not mutant.lines or any(
            reached.AT_IMPORT in lines.get(line, ()) for line in mutant.lines[0]
        )

    def patience(self, tests: Iterable[str]) -> float:
        """Seconds after which these tests hang: several times what they have taken."""
        took = (self._record.tests[name].seconds for name in tests if name in self._record.tests)
        return min(LONGEST, 45 + 3 * sum(took))

    def _reaching(self, mutant: Mutant) -> set[str]:
        lines = self._record.lines(mutant.path)
        for span in mutant.lines:
            found = set().union(*(lines.get(line, set()) for line in span)) - {reached.AT_IMPORT}
            if found:
                return found
        # a function that no test reaches may run at import, as one that makes a table
        names = [mutant.function.rpartition(".")[2]] if mutant.lines else mutant.names
        used = self._uses.lines(mutant.path, names)
        found = set().union(*(self._record.lines(path).get(line, set()) for path, line in used))
        return found if found or mutant.lines else set().union(*lines.values())

    def _best(self, found: set[str], mutant: Mutant) -> list[list[str]]:
        """First those of files that name the module, then of its package, and others.

        Of each of them those that share most names with the changed line, or reach few lines.
        """
        few_lines = sorted(found, key=lambda name: (self._record.tests[name].lines, name))
        path = mutant.path
        words = _names_in(_text(path).splitlines()[mutant.line - 1])
        words.add(mutant.function.rpartition(".")[2])
        alike = sorted(few_lines, key=lambda name: -len(words & _names_of(name)))
        module = path.removesuffix(".py").replace("/", ".")
        package = path.split("/")[1]
        folder = f"tests/{FOLDERS.get(package, package)}/"
        near = [name for name in alike if module in _text(name.partition("::")[0])]
        beside = [name for name in few_lines if name.startswith(folder)]
        most = MOST_TESTS[0]
        first = [*_varied(near)[: most // 2], *_varied(alike)[: most // 4]]
        first += [*_varied(beside)[: most // 8], *_varied(few_lines)]
        first = list(dict.fromkeys(first))[:most]
        left = list(dict.fromkeys((*first, *self._different(few_lines, path), *_spread(few_lines))))
        parts = []
        for number, seconds in zip(MOST_TESTS, MOST_SECONDS, strict=True):
            part: list[str] = []
            longest = seconds / 4  # one slow test leaves time for others
            for name in left:
                takes = self._record.tests[name].seconds
                if len(part) < number and takes < min(seconds, longest):
                    part.append(name)
                    seconds -= takes
            left = [name for name in left if name not in part]
            parts.append(part)
        quick = [name for name in near if self._record.tests[name].seconds <= QUICK]
        parts[0] += [name for name in quick if name not in parts[0]][:MOST_QUICK]
        return [sorted(part, key=lambda name: self._record.tests[name].seconds) for part in parts]

    def _different(self, names: Sequence[str], path: str) -> Iterator[str]:
        """Tests that together reach each line of the module that any of these tests reaches."""
        lines: dict[str, set[int]] = {name: set() for name in names}
        for line, tests in self._record.lines(path).items():
            for name in tests & lines.keys():
                lines[name].add(line)
        left = set().union(*lines.values())
        while left:
            best = max(lines, key=lambda name: len(lines[name] & left))
            left -= lines[best]
            yield best


def _spread(names: Iterable[str]) -> list[str]:
    """Tests in the same order, but one of each file, then a second one of each, and so on."""
    count: Counter[str] = Counter()
    turns: list[tuple[int, str]] = []
    for name in names:
        file = name.partition("::")[0]
        turns.append((count[file], name))
        count[file] += 1
    return [name for _, name in sorted(turns, key=lambda turn: turn[0])]


def _varied(names: Iterable[str]) -> list[str]:
    """Tests in the same order, but those of a function with yet other parameters last."""
    count: Counter[str] = Counter()
    first: list[str] = []
    last: list[str] = []
    for name in names:
        function = name.partition("[")[0]
        count[function] += 1
        (first if count[function] <= MOST_ALIKE else last).append(name)
    return first + last


def _names_in(text: str) -> set[str]:
    return set(re.findall(r"[A-Za-z_]{4,}", text))


def _pieces(text: str) -> set[str]:
    """Names in a text, and the words of which they consist."""
    return _names_in(text) | set(re.findall("[a-z]{4,}", text))


@cache
def _pieces_by_function(file: str) -> dict[str, set[str]]:
    """By each function of a test file: the names and words in its own name and its source."""
    pieces = re.split(r"^(?:async )?def (\w+)", _text(file), flags=re.MULTILINE)
    both = zip(pieces[1::2], pieces[2::2], strict=True)
    return {name: _pieces(f"{name} {body}") for name, body in both}


@cache
def _names_by_function(file: str) -> dict[str, set[str]]:
    """By each test function of a file: the names in its source."""
    pieces = re.split(r"^(?:async )?def (\w+)", _text(file), flags=re.MULTILINE)
    return {name: _names_in(body) for name, body in zip(pieces[1::2], pieces[2::2], strict=True)}


def _names_of(test: str) -> set[str]:
    file, _, function = test.partition("[")[0].partition("::")
    return _names_by_function(file).get(function, set())


def _shared_words(path: str, file: str) -> int:
    """Count words of a path that begin a word of a test file's name, or begin with it."""
    words, others = (re.findall("[a-z]{4,}", name) for name in (path, Path(file).stem))
    pairs = ((word, other) for word in set(words) for other in set(others))
    return sum(word.startswith(other) or other.startswith(word) for word, other in pairs)


@cache
def _test_files() -> list[str]:
    """Files of tests, of all layers."""
    return sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py"))


@cache
def _tests_with() -> Counter[str]:
    """By each name: the number of test functions that have it in their source."""
    each = (names for file in _test_files() for names in _pieces_by_function(file).values())
    return Counter(name for names in each for name in names)


@cache
def _text(file: str) -> str:
    try:
        return (ROOT / file).read_text("utf-8")
    except OSError:
        return ""


def _exists(name: str) -> bool:
    """True if a test that was recorded has its file and function still."""
    file, _, function = name.partition("[")[0].partition("::")
    return f"def {function.rpartition('::')[2]}(" in _text(file)


# -- planting --------------------------------------------------------------------------------------


class Judge:
    """Plants one defect at a time in copies, and believes only a test that fails by it alone."""

    def __init__(
        self, chooser: Chooser, mutants: Iterable[Mutant], forks: Mapping[Path, Forks]
    ) -> None:
        self._chooser = chooser
        self._forks = forks
        # by the source of this moment, which the copies have
        self._tests = {
            mutant: (chooser.tests(mutant), chooser.runs_at_import(mutant)) for mutant in mutants
        }
        self._passes: set[str] = set()

    def judge(self, mutant: Mutant, copy: Path) -> Judged:
        """Plant a defect in a copy and run the tests that reach it."""
        begun = time.monotonic()
        tests, runs_at_import = self._tests[mutant]
        if mutant.identity in EQUIVALENT:
            by = EQUAL
        else:
            by = self._noticed_by(mutant, tests, copy, runs_at_import) if tests else UNREACHED
            if by == SURVIVED and not self._chooser.is_reached(mutant):
                by = UNREACHED
        package = mutant.path.split("/")[1]
        seconds = time.monotonic() - begun
        count = sum(map(len, tests))
        return Judged(mutant.identity, package, mutant.line, by, seconds, count)

    def _noticed_by(
        self, mutant: Mutant, parts: list[list[str]], copy: Path, runs_at_import: bool
    ) -> str:
        """The test that fails in forks, or in a new process if only that runs the defect."""
        path = copy / mutant.path
        before = path.read_text("utf-8")
        after = mutant.apply(before)

        def in_fork(tests: list[str], defective: bool) -> str:
            change = (mutant.path, before, after) if defective else ("", "", "")
            result = self._forks[copy].run(tests, *change, self._chooser.patience(tests))
            if result.not_swapped:
                raise NotSwapped(result.not_swapped)
            return result.failed

        def in_process(tests: list[str], defective: bool) -> str:
            with replaced(path, after if defective else before):
                return _first_failure(tests, copy)

        try:
            with replaced(path, after):  # for programs that tests start
                by = self._search(parts, in_fork)
        except NotSwapped:
            by, runs_at_import = "", True
        return by or (self._search(parts, in_process) if runs_at_import else "") or SURVIVED

    def _search(self, parts: list[list[str]], run: Callable[[list[str], bool], str]) -> str:
        """The first test that fails twice with the defect and passes without it; else empty."""
        for tests in parts:
            while tests and (failed := _first_failure_of(tests, run)):
                if run([failed], True) and self._passes_without(failed, run):
                    return failed
                # it may be one of a file, or of a function with parameters, that was chosen
                chosen = (n for n, name in enumerate(tests, 1) if _is_of(failed, name))
                tests = tests[next(chosen, len(tests)) :]
        return ""

    def _passes_without(self, test: str, run: Callable[[list[str], bool], str]) -> bool:
        # a failure may be of a busy computer, and is tried again for the next defect
        if test not in self._passes and not run([test], False):
            self._passes.add(test)
        return test in self._passes


def _first_failure_of(tests: list[str], run: Callable[[list[str], bool], str]) -> str:
    """The first test that fails; on a busy computer a fork may hang before it, and runs again."""
    failed = run(tests, True)
    return run(tests, True) if failed == HUNG else failed


def _is_of(test: str, name: str) -> bool:
    """True if a name stands for this test, alone or with others."""
    return test == name or test.startswith((f"{name}::", f"{name}["))


def _first_failure(tests: list[str], copy: Path) -> str:
    """The test that fails, the first one if it hangs as a whole; empty if all pass."""
    tests = tests.copy()
    while tests:
        status, output = run_tests(tests, copy)
        if status in (0, 5):
            return ""
        failed = [
            test for test in tests if re.search(rf"^(FAILED|ERROR) {re.escape(test)}", output, re.M)
        ]
        if failed:
            return failed[0]
        gone = re.findall(r"not found: \S*?(tests/\S+::.*)$", output, re.M)
        if not any(test in tests for test in gone):
            return tests[0]  # the process hung, or no module can be imported
        tests = [test for test in tests if test not in gone]
    return ""


# -- report ----------------------------------------------------------------------------------------


def report(results: Sequence[Judged]) -> str:
    """The rate of each package, as Markdown, and the defects that were not noticed."""
    lines = ["| package | planted | noticed | survived | not reached | equivalent | rate |"]
    lines.append("|---|---:|---:|---:|---:|---:|---:|")
    for package in (*PACKAGES, "all"):
        these = [result for result in results if package in (result.package, "all")]
        if these:
            count = Counter(result.noticed_by for result in these)
            noticed = sum(result.noticed for result in these)
            lines.append(
                f"| {package} | {len(these)} | {noticed} | {count[SURVIVED]} | {count[UNREACHED]}"
                f" | {count[EQUAL]} | {rate(these):.1%} |"
            )
    for outcome in (UNREACHED, SURVIVED):
        missed = sorted(result.identity for result in results if result.noticed_by == outcome)
        lines += [f"\n{outcome}: {len(missed)}", *(f"  {result}" for result in missed)]
    return "\n".join(lines)


def rate(results: Sequence[Judged]) -> float:
    """The share of noticed ones among those that change behavior."""
    changing = [result for result in results if result.noticed_by != EQUAL]
    return sum(result.noticed for result in changing) / len(changing) if changing else 1.0


def record_tests(tests: Sequence[str], jobs: int) -> int:
    """Run tests of the main layer in a copy, and keep what each reaches, by the commit."""
    commit = reached.git("rev-parse", "HEAD").strip()
    with copies(1) as (copy,):
        record = reached.record(copy, commit, tests, jobs)
    print(f"{len(record.tests)} tests are recorded for {commit[:12]} in {reached.folder()}.")
    return 0


def main(requested: argparse.Namespace) -> int:
    """Record, or plant and report; 1 if less than required is noticed."""
    if requested.coverage:
        return record_tests(requested.names, requested.jobs)
    record = reached.recorded()
    if record is None:
        raise SystemExit("Nothing is recorded: run `python -m tests.mutants --coverage` first.")
    defaults = Defaults(map(tree_of, modules()))
    packages = requested.package or PACKAGES
    sites = {package: list(all_sites(package, defaults)) for package in packages}
    if requested.stop_path:
        places = stop_path()
        sites = {package: _within(found, places) for package, found in sites.items()}
    if requested.again:
        missed = {kept["identity"] for kept in json.loads(LAST_RUN.read_text("utf-8"))}
        each = (mutant for found in sites.values() for site in found for mutant in site.mutants)
        mutants = [mutant for mutant in each if mutant.identity in missed]
    else:
        mutants = sample(sites, requested.random, requested.seed)
    results: list[Judged] = []

    def show(result: Judged) -> None:
        results.append(result)
        kept = [asdict(result) for result in results if not result.noticed]
        LAST_RUN.write_text(json.dumps(kept, indent=1), "utf-8")
        print(
            f"{result.seconds:6.1f} s  {result.noticed_by} ({result.tests} tests)"
            f" | {result.identity[:200]} (line {result.line})",
            flush=True,
        )

    with copies(requested.jobs) as made, ExitStack() as stack:
        forks = {copy: stack.enter_context(closing(Forks(copy))) for copy in made}
        dealt(Judge(Chooser(record), mutants, forks).judge, mutants, made, show)
    print(
        f"\n{len(mutants)} defects, seed {requested.seed}, recorded at {record.commits[0][:12]}\n"
    )
    print(report(results))
    return 0 if rate(results) >= (1.0 if requested.stop_path else LEAST) else 1


def _within(sites: Iterable[Site], places: set[tuple[str, str]]) -> list[Site]:
    return [site for site in sites if (site.mutants[0].path, site.mutants[0].function) in places]
